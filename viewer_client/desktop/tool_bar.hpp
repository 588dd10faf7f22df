// The left bar: a button for each of the eight groups of tools. A short click takes the tool that the button shows. A
// long click, or the arrow, opens the group's other tools, as in Niu 2008, §9.3.
#pragma once
#include <QToolBar>
#include <functional>
#include <map>
#include <string>

class QAction;
class QActionGroup;
class QMenu;
class QToolButton;

namespace osteon {

class SurgeryToolBar : public QToolBar {
 public:
  // `taken`: the user chose this tool.
  explicit SurgeryToolBar(std::function<void(const std::string& tool)> taken, QWidget* parent = nullptr);

  // The same actions, in groups, for a menu: everything in the window is in a menu too.
  void fill(QMenu& menu);
  // In the bar and in the menu. `reason`: why they are disabled.
  void set_tools_enabled(bool on, const QString& reason);
  // Shows which tool is held. Empty: none.
  void show_held(const std::string& tool);
  [[nodiscard]] QAction* action(const std::string& tool) const;

 private:
  void take(const std::string& tool);

  std::function<void(const std::string&)> taken_;
  QActionGroup* group_;
  std::map<std::string, QAction*> actions_;
  std::map<std::string, QToolButton*> buttons_;  // of a tool's group
};

}  // namespace osteon
