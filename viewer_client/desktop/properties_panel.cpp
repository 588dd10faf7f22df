#include "viewer_client/desktop/properties_panel.hpp"

#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QCoreApplication>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QLabel>
#include <QLocale>
#include <QMargins>
#include <QSpinBox>
#include <QVBoxLayout>
#include <algorithm>
#include <initializer_list>
#include <utility>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/tools/tool.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/tool_names.hpp"
#include "viewer_client/scene/tool_groups.hpp"
#include "viewer_client/scene/tool_pointer.hpp"

namespace osteon {

namespace {

constexpr int kMostRpm = 100000;

// Makes a box wide enough for each of its items, and empties it. So the panel never changes its width, and neither does
// the picture beside it.
void fix_width(QComboBox& box) {
  box.setMinimumWidth(box.sizeHint().width());
  box.clear();
}

}  // namespace

PropertiesPanel::PropertiesPanel(std::function<void(const Chosen&)> changed,
                                 std::function<void(const std::string&)> resized, QWidget* parent)
    : QWidget(parent), changed_(std::move(changed)), resized_(std::move(resized)) {
  of_tool_ = new QWidget;
  auto* form = new QFormLayout(of_tool_);
  auto* all = new QVBoxLayout(this);
  all->setContentsMargins(0, 0, 0, 0);
  all->addWidget(of_tool_);
  switches_ = new QVBoxLayout;
  const QMargins beside = form->contentsMargins();
  switches_->setContentsMargins(beside.left(), 0, beside.right(), beside.bottom());
  all->addLayout(switches_);
  all->addStretch();
  const auto row = [&](const QString& what, const char* name, QWidget* widget) {
    widget->setObjectName(name);
    // A screen reader would read the name of a label instead of its text. The row names it too.
    if (qobject_cast<QLabel*>(widget) == nullptr) widget->setAccessibleName(what);
    form->addRow(what, widget);
  };
  size_ = new QComboBox;
  size_->setObjectName("size");
  size_->setAccessibleName(tr("Tool"));
  for (const ToolGroup& group : tool_groups())
    for (const std::string& tool : group.tools) size_->addItem(tool_title(tool));
  fix_width(*size_);
  form->addRow(size_);
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
  wear_ = new QDoubleSpinBox;
  wear_->setRange(kSharp, kBluntest);
  wear_->setDecimals(1);
  wear_->setSingleStep(0.1);
  wear_->setKeyboardTracking(false);  // half a typed number does not count
  wear_->setToolTip("<p>" + tr("1 is sharp, 2 is blunt. A change acts at once, also while the tool cuts.") + ' ' +
                    tr("Cutting blunts the tool further. The gauge shows how blunt it is.") + "</p>");
  row(tr("Wear"), "wear_set", wear_);
  law_ = new QComboBox;
  law_->setObjectName("law_set");
  law_->setAccessibleName(tr("Force law"));
  for (const ForceLaw& law : force_laws()) law_->addItem(law_title(std::string(law.name)));
  fix_width(*law_);
  form->addRow(new QLabel(tr("Force law")));
  form->addRow(law_);  // over the whole width, because names of laws are long
  const auto say = [this] {
    if (!showing_) changed_(chosen());
  };
  connect(rpm_, QOverload<int>::of(&QSpinBox::valueChanged), this, say);
  connect(push_, QOverload<int>::of(&QSpinBox::valueChanged), this, say);
  connect(size_, QOverload<int>::of(&QComboBox::activated), this,
          [this](int index) { resized_(size_->itemData(index).toString().toStdString()); });
  connect(wear_, QOverload<double>::of(&QDoubleSpinBox::valueChanged), this, [this, say](double wear) {
    if (!showing_) chosen_[tool_].wear = wear;
    say();
  });
  connect(law_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, [this, say](int index) {
    const QString law = law_->itemData(index).toString();
    law_->setToolTip(law.isEmpty() ? QString() : tr("The law \"%1\" in the list of osteon-haptic laws").arg(law));
    if (!showing_) chosen_[tool_].law = law.toStdString();
    say();
  });
}

void PropertiesPanel::show_wear_and_law(const Tool& tool, const QString& not_held) {
  for (QWidget* part : std::initializer_list<QWidget*>{wear_, law_}) set_enabled(*part, true, {});
  const auto found = chosen_.find(tool.name);
  const WearAndLaw chosen = found == chosen_.end() ? WearAndLaw{} : found->second;
  wear_->setValue(chosen.wear.value_or(kSharp));
  law_->clear();
  for (const ForceLaw& law : force_laws())
    if (tool.cuts() && law.fits(tool.kind))
      law_->addItem(law_title(std::string(law.name)), QString::fromStdString(std::string(law.name)));
  if (const Result<const ForceLaw*> law = choose_law(tool, chosen.law))
    law_->setCurrentIndex(law_->findData(QString::fromStdString(std::string((*law)->name))));
  for (QWidget* part : std::initializer_list<QWidget*>{wear_, law_}) set_enabled(*part, not_held.isEmpty(), not_held);
}

void PropertiesPanel::show_none(const QString& reason) { set_enabled(*of_tool_, false, reason); }

void PropertiesPanel::show_tool(const std::string& name, const QString& not_held) {
  const Result<Tool> tool = find_tool(name);
  if (!tool) return;
  set_enabled(*of_tool_, true, {});
  showing_ = true;
  tool_ = name;
  size_->clear();
  for (const ToolGroup& group : tool_groups()) {
    if (std::find(group.tools.begin(), group.tools.end(), name) == group.tools.end()) continue;
    for (const std::string& other : group.tools) size_->addItem(tool_title(other), QString::fromStdString(other));
  }
  size_->setCurrentIndex(size_->findData(QString::fromStdString(name)));
  rpm_->setValue(static_cast<int>(tool->spindle_rpm));
  set_enabled(*rpm_, tool->spindle_rpm > 0.0, tr("This tool has no spindle."));
  teeth_->setText(tool->teeth > 0 ? QString::number(tool->teeth) : QString("–"));
  feed_->setText(tool->feed_mm_per_rev > 0.0 ? tr("%1 mm").arg(QLocale().toString(tool->feed_mm_per_rev, 'g', 3))
                                             : QString("–"));
  show_wear_and_law(*tool, not_held);
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
  switches_->addWidget(box);
  connect(box, &QCheckBox::clicked, &action, &QAction::trigger);
  connect(&action, &QAction::toggled, box, &QCheckBox::setChecked);
  connect(&action, &QAction::changed, box,
          [box, action = &action] { set_enabled(*box, action->isEnabled(), action->toolTip()); });
}

PropertiesPanel::Chosen PropertiesPanel::chosen() const {
  const auto found = chosen_.find(tool_);
  return {static_cast<double>(rpm_->value()), static_cast<double>(push_->value()),
          found == chosen_.end() ? WearAndLaw{} : found->second};
}

}  // namespace osteon
