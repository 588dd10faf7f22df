#include "viewer_client/desktop/properties_panel.hpp"

#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QCoreApplication>
#include <QFormLayout>
#include <QLabel>
#include <QLocale>
#include <QSpinBox>
#include <algorithm>
#include <utility>

#include "common/tools/tool.hpp"
#include "viewer_client/desktop/tool_names.hpp"
#include "viewer_client/scene/tool_groups.hpp"
#include "viewer_client/scene/tool_pointer.hpp"

namespace osteon {

namespace {

constexpr int kMostRpm = 100000;

}  // namespace

PropertiesPanel::PropertiesPanel(std::function<void(const Chosen&)> changed,
                                 std::function<void(const std::string&)> resized, QWidget* parent)
    : QWidget(parent), changed_(std::move(changed)), resized_(std::move(resized)) {
  form_ = new QFormLayout(this);
  const auto row = [&](const QString& what, const char* name, QWidget* widget) {
    widget->setObjectName(name);
    widget->setAccessibleName(what);
    form_->addRow(what, widget);
  };
  size_ = new QComboBox;
  size_->setObjectName("size");
  size_->setAccessibleName(tr("Tool"));
  // Wide enough for every tool, so that the panel, and with it the picture beside it, never changes its width.
  for (const ToolGroup& group : tool_groups())
    for (const std::string& tool : group.tools) size_->addItem(tool_title(tool));
  size_->setMinimumWidth(size_->sizeHint().width());
  size_->clear();
  form_->addRow(size_);
  rpm_ = new QSpinBox;
  rpm_->setRange(0, kMostRpm);
  rpm_->setSingleStep(100);
  rpm_->setSuffix(tr(" rpm"));
  row(tr("Spindle"), "rpm", rpm_);
  push_ = new QSpinBox;
  push_->setRange(static_cast<int>(kLeastPush_n), static_cast<int>(kMostPush_n));
  push_->setSuffix(tr(" N"));
  row(tr("Push"), "push_set", push_);
  teeth_ = new QLabel;
  row(tr("Teeth"), "teeth", teeth_);
  feed_ = new QLabel;
  row(tr("Feed per revolution"), "feed_per_turn", feed_);
  const auto say = [this] {
    if (!showing_) changed_(chosen());
  };
  connect(rpm_, QOverload<int>::of(&QSpinBox::valueChanged), this, say);
  connect(push_, QOverload<int>::of(&QSpinBox::valueChanged), this, say);
  connect(size_, QOverload<int>::of(&QComboBox::activated), this,
          [this](int index) { resized_(size_->itemData(index).toString().toStdString()); });
  setEnabled(false);
}

void PropertiesPanel::show_tool(const std::string& name) {
  const Result<Tool> tool = find_tool(name);
  setEnabled(tool.has_value());
  if (!tool) return;
  showing_ = true;
  size_->clear();
  for (const ToolGroup& group : tool_groups()) {
    if (std::find(group.tools.begin(), group.tools.end(), name) == group.tools.end()) continue;
    for (const std::string& other : group.tools) size_->addItem(tool_title(other), QString::fromStdString(other));
  }
  size_->setCurrentIndex(size_->findData(QString::fromStdString(name)));
  rpm_->setValue(static_cast<int>(tool->spindle_rpm));
  rpm_->setEnabled(tool->spindle_rpm > 0.0);
  teeth_->setText(tool->teeth > 0 ? QString::number(tool->teeth) : QString("–"));
  feed_->setText(tool->feed_mm_per_rev > 0.0 ? tr("%1 mm").arg(QLocale().toString(tool->feed_mm_per_rev, 'g', 3))
                                             : QString("–"));
  showing_ = false;
}

void PropertiesPanel::show_push(double push_n) {
  const int value = static_cast<int>(push_n);
  if (push_->value() == value) return;  // setValue() always paints, and Qt then puts the whole window together again
  showing_ = true;
  push_->setValue(value);
  showing_ = false;
}

void PropertiesPanel::add_switch(QAction& action) {
  auto* box = new QCheckBox(action.iconText());
  box->setObjectName(action.objectName() + "_box");
  box->setChecked(action.isChecked());
  form_->addRow(box);
  connect(box, &QCheckBox::clicked, &action, &QAction::trigger);
  connect(&action, &QAction::toggled, box, &QCheckBox::setChecked);
  connect(&action, &QAction::changed, box, [box, action = &action] { box->setEnabled(action->isEnabled()); });
}

PropertiesPanel::Chosen PropertiesPanel::chosen() const {
  return {static_cast<double>(rpm_->value()), static_cast<double>(push_->value())};
}

}  // namespace osteon
