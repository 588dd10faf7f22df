#include "viewer_client/desktop/menu_keys.hpp"

#include <QAction>
#include <QKeySequence>
#include <QMenu>
#include <QSet>

namespace osteon {

namespace {

// Null: it has none.
QString menu_key(const QString& text) { return QKeySequence::mnemonic(text).toString(QKeySequence::PortableText); }

// The place of the first letter that is free; one at the beginning of a word if there is one. -1: none.
int free_letter(const QString& text, const QSet<QString>& taken) {
  int found = -1;
  for (int i = 0; i < text.size(); ++i) {
    if (!text[i].isLetterOrNumber() || taken.contains("Alt+" + text.mid(i, 1).toUpper())) continue;
    if (i == 0 || text[i - 1].isSpace()) return i;
    if (found < 0) found = i;
  }
  return found;
}

}  // namespace

void add_menu_keys(QMenu& menu) {
  QSet<QString> taken;
  for (const QAction* action : menu.actions()) taken.insert(menu_key(action->text()));
  for (QAction* action : menu.actions()) {
    if (action->menu() != nullptr) add_menu_keys(*action->menu());
    if (action->isSeparator() || !menu_key(action->text()).isEmpty()) continue;
    const int at = free_letter(action->text(), taken);
    if (at < 0) continue;
    action->setText(QString(action->text()).insert(at, '&'));
    taken.insert(menu_key(action->text()));
  }
}

}  // namespace osteon
