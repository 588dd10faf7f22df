// Disables parts of the window. The tool tip of a disabled part says why it is disabled.
#pragma once
#include <QString>

class QAction;
class QMenu;
class QWidget;

namespace osteon {

// `reason`: why it is disabled, one sentence. An enabled action has no tool tip but its text.
void set_enabled(QAction& action, bool on, const QString& reason);
// A widget. A disabled panel also says the reason over its parts without a tool tip. An enabled widget gets its own
// tool tip back. Who changes that tip enables the widget first.
void set_enabled(QWidget& part, bool on, const QString& reason);

// The entries of the menu and of its submenus show their tool tips.
void show_tool_tips(QMenu& menu);

}  // namespace osteon
