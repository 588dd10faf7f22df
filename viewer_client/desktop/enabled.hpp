// What is disabled says why, in its tool tip. Where the style of the desktop chooses disabled entries of menus, the
// status bar says it too.
#pragma once
#include <QString>

class QAction;
class QMenu;
class QWidget;

namespace osteon {

// `reason`: why it is disabled, one sentence. An enabled action has no tool tip but its text.
void set_enabled(QAction& action, bool on, const QString& reason);
// A panel, with the parts that have no tool tip of their own.
void set_enabled(QWidget& panel, bool on, const QString& reason);

// The entries of the menu and of its submenus show their tool tips.
void show_tool_tips(QMenu& menu);

}  // namespace osteon
