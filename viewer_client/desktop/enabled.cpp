#include "viewer_client/desktop/enabled.hpp"

#include <QAction>
#include <QMenu>
#include <QVariant>
#include <QWidget>

namespace osteon {

namespace {

constexpr const char* kOwnTip = "own_tool_tip";  // the property with the tip of an enabled part, while it is disabled

}  // namespace

void set_enabled(QAction& action, bool on, const QString& reason) {
  action.setEnabled(on);
  action.setToolTip(on ? QString() : reason);
}

void set_enabled(QWidget& part, bool on, const QString& reason) {
  part.setEnabled(on);
  const QVariant own = part.property(kOwnTip);
  if (!on) {
    if (!own.isValid()) part.setProperty(kOwnTip, part.toolTip());
    part.setToolTip(reason);
  } else if (own.isValid()) {
    part.setToolTip(own.toString());
    part.setProperty(kOwnTip, QVariant());
  }
}

void show_tool_tips(QMenu& menu) {
  menu.setToolTipsVisible(true);
  for (const QAction* action : menu.actions())
    if (action->menu() != nullptr) show_tool_tips(*action->menu());
}

}  // namespace osteon
