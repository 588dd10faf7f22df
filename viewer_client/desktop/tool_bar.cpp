#include "viewer_client/desktop/tool_bar.hpp"

#include <QAction>
#include <QActionGroup>
#include <QCoreApplication>
#include <QMenu>
#include <QToolButton>
#include <utility>

#include "common/tools/tool.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/tool_icon.hpp"
#include "viewer_client/desktop/tool_names.hpp"
#include "viewer_client/scene/tool_groups.hpp"

namespace osteon {

SurgeryToolBar::SurgeryToolBar(std::function<void(const std::string& tool)> taken, QWidget* parent)
    : QToolBar(parent), taken_(std::move(taken)), group_(new QActionGroup(this)) {
  setObjectName("tools");
  setWindowTitle(QCoreApplication::translate("Tools", "Tools"));
  setIconSize({36, 36});
  group_->setExclusionPolicy(QActionGroup::ExclusionPolicy::ExclusiveOptional);
  for (const ToolGroup& group : tool_groups()) {
    auto* button = new QToolButton;
    button->setObjectName(QString::fromUtf8(group.name.data(), static_cast<int>(group.name.size())));
    auto* menu = new QMenu(button);
    for (const std::string& name : group.tools) {
      const Result<Tool> tool = find_tool(name);
      if (!tool) continue;
      auto* action = new QAction(tool_icon(*tool), tool_title(name), this);
      action->setCheckable(true);
      group_->addAction(action);
      menu->addAction(action);
      connect(action, &QAction::triggered, this, [this, name] { take(name); });
      actions_[name] = action;
      buttons_[name] = button;
    }
    button->setDefaultAction(actions_.at(group.tools.front()));
    button->setMenu(menu);
    button->setPopupMode(QToolButton::DelayedPopup);
    button->setAccessibleName(group_title(std::string(group.name)));
    button->setFocusPolicy(Qt::TabFocus);
    addWidget(button);
  }
}

void SurgeryToolBar::take(const std::string& tool) {
  buttons_.at(tool)->setDefaultAction(actions_.at(tool));
  taken_(tool);
}

void SurgeryToolBar::fill(QMenu& menu) {
  for (const ToolGroup& group : tool_groups()) {
    QMenu* part = menu.addMenu(group_title(std::string(group.name)));
    for (const std::string& name : group.tools) part->addAction(actions_.at(name));
  }
}

void SurgeryToolBar::set_tools_enabled(bool on, const QString& reason) {
  for (const auto& [name, action] : actions_) set_enabled(*action, on, reason);
}

void SurgeryToolBar::show_held(const std::string& tool) {
  const auto found = actions_.find(tool);
  if (found != actions_.end()) {
    found->second->setChecked(true);
    buttons_.at(tool)->setDefaultAction(found->second);
  } else if (QAction* checked = group_->checkedAction()) {
    checked->setChecked(false);
  }
}

QAction* SurgeryToolBar::action(const std::string& tool) const {
  const auto found = actions_.find(tool);
  return found == actions_.end() ? nullptr : found->second;
}

}  // namespace osteon
