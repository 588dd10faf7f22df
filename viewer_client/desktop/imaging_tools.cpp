#include "viewer_client/desktop/imaging_tools.hpp"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLineEdit>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QToolButton>
#include <algorithm>
#include <set>
#include <utility>

#include "viewer_client/desktop/enabled.hpp"

namespace osteon {

namespace {

constexpr double kLeastBrush_mm = 0.1, kMostBrush_mm = 50.0, kFirstBrush_mm = 3.0, kBrushStep_mm = 0.5;
constexpr int kLongestBoneName = 30, kBoneNameWidth_px = 90;

// The bones that a seed or paint makes.
std::set<int> bones_of(const ImagingEdits& edits) {
  std::set<int> bones;
  for (const KeptSeed& seed : edits.seeds) bones.insert(seed.bone);
  for (const SharedCorrection& correction : edits.corrections)
    if (correction->kind == CorrectionKind::paint) bones.insert(correction->bone);
  bones.erase(0);
  return bones;
}

}  // namespace

ImagingTools::ImagingTools(std::function<void()> changed, QWidget* parent)
    : QWidget(parent), changed_(std::move(changed)) {
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(2);
  const Words all[] = {
      {ImagingTool::look, tr("Crosshair"), "tool_look", tr("The left button moves the crosshair"), "Ctrl+Alt+4"},
      {ImagingTool::paint, tr("Paint"), "tool_paint", tr("What the brush touches becomes bone"), "Ctrl+Alt+5"},
      {ImagingTool::erase, tr("Erase"), "tool_erase", tr("What the brush touches is no bone"), "Ctrl+Alt+6"},
      {ImagingTool::cut, tr("Cut"), "tool_cut",
       tr("Drag a line. What is to its right is cut off the bone where the line begins."), "Ctrl+Alt+7"},
      {ImagingTool::outside, tr("Outside"), "tool_outside",
       tr("Click on what is no bone and touches one. It is separated and left out."), "Ctrl+Alt+8"},
      {ImagingTool::box, tr("Box"), "tool_box",
       tr("Drag a rectangle on two planes. Only the box counts. A click takes it away."), "Ctrl+Alt+9"},
      {ImagingTool::landmark, tr("Landmark"), "tool_landmark",
       tr("Click where the landmark of the field Landmark is. The case keeps it."), "Ctrl+Alt+M"},
  };
  for (const Words& words : all) add_tool(*row, words);
  radius_ = new QDoubleSpinBox;
  radius_->setObjectName("brush_radius");
  radius_->setAccessibleName(tr("Radius of the brush"));
  radius_->setToolTip(tr("Radius of the brush, also Ctrl and the wheel"));
  radius_->setRange(kLeastBrush_mm, kMostBrush_mm);
  radius_->setDecimals(1);
  radius_->setSingleStep(kBrushStep_mm);
  radius_->setSuffix(tr(" mm"));
  radius_->setValue(kFirstBrush_mm);
  connect(radius_, QOverload<double>::of(&QDoubleSpinBox::valueChanged), this, [this] { changed_(); });
  row->addWidget(radius_);
  flat_ = new QCheckBox(tr("One slice"));
  flat_->setObjectName("brush_flat");
  flat_->setToolTip(tr("The brush is a disc in the slice that you see, instead of a ball"));
  flat_->setShortcut(QKeySequence("Ctrl+Alt+O"));
  row->addWidget(flat_);
  row->addStretch();
  choose(ImagingTool::look);
}

void ImagingTools::add_tool(QBoxLayout& row, const Words& words) {
  auto* button = new QToolButton;
  button->setObjectName(words.name);
  button->setText(words.text);
  button->setCheckable(true);
  button->setAutoRaise(true);
  button->setShortcut(QKeySequence(words.keys));
  button->setToolTip(QString("%1 (%2)").arg(words.tip, button->shortcut().toString(QKeySequence::NativeText)));
  button->setProperty("tool", static_cast<int>(words.tool));
  connect(button, &QToolButton::clicked, this, [this, tool = words.tool] { choose(tool); });
  buttons_.push_back(button);
  row.addWidget(button);
}

void ImagingTools::choose(ImagingTool tool) {
  tool_ = tool;
  for (QToolButton* button : buttons_) button->setChecked(button->property("tool").toInt() == static_cast<int>(tool));
  const bool brush = tool == ImagingTool::paint || tool == ImagingTool::erase;
  const QString reason = tr("Choose the brush first: Paint or Erase.");
  set_enabled(*radius_, brush, reason);
  set_enabled(*flat_, brush, reason);
  changed_();
}

double ImagingTools::radius_mm() const { return radius_->value(); }

bool ImagingTools::flat() const { return flat_->isChecked(); }

void ImagingTools::turn_radius(int notches) { radius_->setValue(radius_->value() + notches * kBrushStep_mm); }

void ImagingTools::set_found(bool found, const QString& reason) {
  for (QToolButton* button : buttons_) {
    const int tool = button->property("tool").toInt();
    const bool always = tool == static_cast<int>(ImagingTool::look) || tool == static_cast<int>(ImagingTool::box) ||
                        tool == static_cast<int>(ImagingTool::landmark);
    set_enabled(*button, found || always, reason);
  }
}

void ImagingTools::reset() { choose(ImagingTool::look); }

ImagingBoneChoice::ImagingBoneChoice(Events events, QWidget* parent) : QWidget(parent), events_(std::move(events)) {
  auto* form = new QFormLayout(this);
  form->setContentsMargins(0, 0, 0, 0);
  bone_ = new QComboBox;
  bone_->setObjectName("bone_choice");
  bone_->setAccessibleName(tr("Bone of the tools"));
  bone_->setToolTip(tr("The bone of the next seed, paint or cut. Seeds of one bone merge their parts."));
  connect(bone_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, [this] { show_bone(); });
  form->addRow(tr("Bone"), bone_);
  auto* row = new QHBoxLayout;
  name_ = new QLineEdit;
  name_->setObjectName("bone_name");
  name_->setAccessibleName(tr("Name of the bone"));
  name_->setToolTip(tr("Name of the bone in the case, such as femur"));
  name_->setMaxLength(kLongestBoneName);
  name_->setMinimumWidth(kBoneNameWidth_px);
  connect(name_, &QLineEdit::editingFinished, this, [this] {
    const BoneLabel* label = label_of(edits_, bone());
    const QString shown = QString::fromStdString(label != nullptr ? label->name : plain_name(bone()));
    if (bone() != 0 && name_->text() != shown) events_.name(bone(), name_->text());
  });
  row->addWidget(name_, 1);
  opacity_ = new QSpinBox;
  opacity_->setObjectName("bone_opacity");
  opacity_->setAccessibleName(tr("Opacity of its tint"));
  opacity_->setToolTip(tr("Opacity of its tint"));
  opacity_->setRange(0, 100);
  opacity_->setSingleStep(10);
  opacity_->setSuffix(tr(" %"));
  // A step for each number that is typed would fill the history.
  opacity_->setKeyboardTracking(false);
  connect(opacity_, QOverload<int>::of(&QSpinBox::valueChanged), this,
          [this](int percent) { events_.fade(bone(), percent); });
  row->addWidget(opacity_);
  form->addRow(tr("Its name"), row);
  follow({});
}

void ImagingBoneChoice::follow(const ImagingEdits& edits) {
  edits_ = edits;
  const int before = bone();
  const QSignalBlocker quiet(bone_);
  bone_->clear();
  bone_->addItem(tr("new, or under the mouse"), 0);
  for (const int bone : bones_of(edits)) {
    const BoneLabel* label = label_of(edits, bone);
    bone_->addItem(
        label != nullptr ? QString("%1: %2").arg(bone).arg(QString::fromStdString(label->name)) : QString::number(bone),
        bone);
  }
  bone_->setCurrentIndex(std::max(0, bone_->findData(before)));
  show_bone();
}

int ImagingBoneChoice::bone() const { return bone_->currentData().toInt(); }

void ImagingBoneChoice::show_bone() {
  const BoneLabel* label = label_of(edits_, bone());
  const bool one = bone() != 0;
  const QString reason = tr("Choose a bone first.");
  set_enabled(*name_, one, reason);
  set_enabled(*opacity_, one, reason);
  const QSignalBlocker quiet_name(name_), quiet_opacity(opacity_);
  const std::string name = !one ? "" : label != nullptr ? label->name : plain_name(bone());
  name_->setText(QString::fromStdString(name));
  opacity_->setValue(label != nullptr ? label->opacity_percent : 100);
}

}  // namespace osteon
