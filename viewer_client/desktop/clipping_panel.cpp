#include "viewer_client/desktop/clipping_panel.hpp"

#include <QCheckBox>
#include <QFormLayout>
#include <QPushButton>
#include <QSlider>
#include <utility>

namespace osteon {

namespace {

constexpr int kSteps = 200;

}  // namespace

ClippingPanel::ClippingPanel(std::function<void(const Clipping&)> changed, std::function<CameraView()> view,
                             QWidget* parent)
    : QWidget(parent), changed_(std::move(changed)), view_(std::move(view)) {
  auto* form = new QFormLayout(this);
  const auto check = [&](const QString& what, const char* name) {
    auto* box = new QCheckBox(what);
    box->setObjectName(name);
    form->addRow(box);
    connect(box, &QCheckBox::toggled, this, [this] { report(); });
    return box;
  };
  box_ = check(tr("A box"), "clip_box");
  // DICOM LPS: x to the patient's left, y to the back, z to the head.
  sides_ = {add_slider(*form, tr("Right"), "clip_right", 0), add_slider(*form, tr("Left"), "clip_left", kSteps),
            add_slider(*form, tr("Front"), "clip_front", 0), add_slider(*form, tr("Back"), "clip_back", kSteps),
            add_slider(*form, tr("Foot"), "clip_foot", 0),   add_slider(*form, tr("Head"), "clip_head", kSteps)};
  plane_ = check(tr("A plane"), "clip_plane");
  depth_ = add_slider(*form, tr("Depth"), "clip_depth", kSteps / 2);
  auto* turn = new QPushButton(tr("Turn the plane to me"));
  turn->setObjectName("clip_turn");
  connect(turn, &QPushButton::clicked, this, [this] { face_viewer(); });
  auto* whole = new QPushButton(tr("Whole bone"));
  whole->setObjectName("clip_whole");
  connect(whole, &QPushButton::clicked, this, [this] { reset(bone_); });
  form->addRow(turn);
  form->addRow(whole);
}

QSlider* ClippingPanel::add_slider(QFormLayout& form, const QString& what, const char* name, int value) {
  auto* slider = new QSlider(Qt::Horizontal);
  slider->setObjectName(name);
  slider->setAccessibleName(what);
  slider->setRange(0, kSteps);
  slider->setValue(value);
  connect(slider, &QSlider::valueChanged, this, [this] { report(); });
  form.addRow(what, slider);
  return slider;
}

void ClippingPanel::reset(const Box& bone) {
  resetting_ = true;
  bone_ = bone;
  box_->setChecked(false);
  plane_->setChecked(false);
  for (std::size_t side = 0; side < sides_.size(); ++side) sides_[side]->setValue(side % 2 == 0 ? 0 : kSteps);
  depth_->setValue(kSteps / 2);
  resetting_ = false;
  report();
}

void ClippingPanel::face_viewer() {
  const CameraView view = view_();
  away_ = (view.target_mm - view.eye_mm).normalized();
  if (plane_->isChecked())
    report();
  else
    plane_->setChecked(true);
}

Clipping ClippingPanel::clipping() const {
  Clipping planes;
  if (bone_.empty()) return planes;
  if (box_->isChecked()) {
    for (int side = 0; side < 6; ++side) {
      const int axis = side / 2;
      Vec3 point_mm = bone_.min_mm;
      point_mm[axis] += bone_.size_mm()[axis] * sides_[static_cast<std::size_t>(side)]->value() / kSteps;
      planes.push_back({point_mm, (side % 2 == 0 ? 1.0 : -1.0) * Vec3::Unit(axis)});
    }
  }
  if (plane_->isChecked()) {
    // From the corner that is nearest to the viewer to the farthest one.
    const double half_mm = 0.5 * bone_.size_mm().dot(away_.cwiseAbs());
    const double depth_mm = half_mm * (2.0 * depth_->value() / kSteps - 1.0);
    planes.push_back({bone_.centre_mm() + depth_mm * away_, away_});
  }
  return planes;
}

void ClippingPanel::report() {
  if (!resetting_) changed_(clipping());
}

}  // namespace osteon
