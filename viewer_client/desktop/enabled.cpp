#include "viewer_client/desktop/enabled.hpp"

#include <QAction>
#include <QMenu>
#include <QWidget>

namespace osteon {

void set_enabled(QAction& action, bool on, const QString& reason) {
  action.setEnabled(on);
  action.setToolTip(on ? QString() : reason);
  action.setStatusTip(on ? QString() : reason);
}

void set_enabled(QWidget& panel, bool on, const QString& reason) {
  panel.setEnabled(on);
  panel.setToolTip(on ? QString() : reason);
}

void show_tool_tips(QMenu& menu) {
  menu.setToolTipsVisible(true);
  for (const QAction* action : menu.actions())
    if (action->menu() != nullptr) show_tool_tips(*action->menu());
}

}  // namespace osteon
