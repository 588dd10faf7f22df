#include "viewer_client/desktop/imaging_solid.hpp"

#include <QCheckBox>
#include <QLabel>
#include <QPainter>
#include <QSignalBlocker>
#include <QStackedWidget>
#include <QVBoxLayout>
#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include "viewer_client/imaging/reduced_scan.hpp"

namespace osteon {

namespace {

constexpr int kEditPause_ms = 150;  // a drag is many edits
constexpr int kFrame_px = 1;        // for the frame of the keyboard's focus
constexpr QColor kFocusFrame{250, 220, 120};
constexpr double kMarkShare = 0.018;  // radius of a mark, of the diagonal of what is seen

VoxelGrid grid_of(const ScanGeometry& scan) { return {scan.dims, scan.origin_mm, scan.axes_mm}; }

Box corners_of(const ScanGeometry& scan) {
  Box box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 voxel;
    for (int axis = 0; axis < 3; ++axis)
      voxel[axis] = (corner >> axis & 1) == 0 ? -0.5 : scan.dims[static_cast<std::size_t>(axis)] - 0.5;
    box.include(scan.position_mm(voxel));
  }
  return box;
}

Box points_of(const std::vector<KeptSurface>& surfaces) {
  Box box;
  for (const KeptSurface& of : surfaces)
    for (const auto& [x, y, z] : of.mesh.positions_mm)
      box.include({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
  return box;
}

}  // namespace

struct ImagingSolid::Job {
  KeptParts kept;
  bool surface = false, soft = false;  // which are to be made
  std::atomic<bool> cancelled{false};
  Result<std::vector<KeptSurface>> bones;
  Result<ShownScan> hu;
};

ImagingSolid::ImagingSolid(const ImagingScene& scene, Events events, QWidget* parent)
    : QWidget(parent), scene_(scene), events_(std::move(events)) {
  setObjectName("solid");
  soft_ = new QCheckBox(tr("Soft tissue"));
  soft_->setObjectName("soft_tissue");
  soft_->setShortcut(QKeySequence("Ctrl+Alt+V"));
  soft_->setToolTip(QString("%1 (%2)").arg(tr("Shows skin and muscle of the scan round the bone"),
                                           soft_->shortcut().toString(QKeySequence::NativeText)));
  hint_ = new QLabel;
  hint_->setObjectName("solid_hint");
  hint_->setWordWrap(true);
  hint_->setAlignment(Qt::AlignCenter);
  view_ = new SolidView(
      {[this](const SolidHit& hit) { events_.choose_bone(hit.bone, voxel_near(scene_.scan.geometry, hit.point_mm)); },
       [this](const SolidHit& hit) {
         // A block's surface lies beside the voxels that are bone.
         const std::array<int, 3> at = voxel_near(scene_.scan.geometry, hit.point_mm);
         events_.look_at(bone_voxel_near(scene_.scan.geometry, scene_.islands, kept(), hit.bone, at).value_or(at));
       },
       [this] { update(); }});
  stack_ = new QStackedWidget;
  stack_->addWidget(hint_);
  stack_->addWidget(view_);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(kFrame_px, kFrame_px, kFrame_px, kFrame_px);
  column->setSpacing(0);
  column->addWidget(soft_);
  column->addWidget(stack_, 1);
  pause_.setSingleShot(true);
  pause_.setInterval(kEditPause_ms);
  connect(&pause_, &QTimer::timeout, this, [this] { ask(); });
  connect(soft_, &QCheckBox::toggled, this, [this](bool on) {
    if (!on) {
      view_->scene().show_soft_tissue({}, {});
      has_soft_ = false;
      view_->redraw();
    }
    ask();
    show_state();
  });
  show_state();
}

ImagingSolid::~ImagingSolid() { release(); }

void ImagingSolid::release() {
  pause_.stop();
  wanted_.reset();
  shown_.reset();
  has_soft_ = false;
  if (!maker_) return;
  job_->cancelled = true;
  maker_->wait();
  maker_.release()->deleteLater();
  job_.reset();
}

void ImagingSolid::begin() {
  const QSignalBlocker quiet(soft_);
  soft_->setChecked(false);
  view_->scene().bones().clear();
  tints_.clear();
  view_->scene().show_soft_tissue({}, {});
  has_surface_ = false;
  problem_.clear();
  cross_.reset();
  const Box bounds = corners_of(scene_.scan.geometry);
  mark_mm_ = kMarkShare * bounds.size_mm().norm();
  view_->set_bounds(bounds);
  view_->look_overview();
  show_state();
  refresh();
}

KeptParts ImagingSolid::kept() const { return {scene_.look.kept, scene_.look.corrections, scene_.look.box}; }

void ImagingSolid::refresh() {
  if (!scene_.open()) return;
  show_cross();
  show_tints();
  show_marks();
  show_boxes();
  show_state();
  // With a threshold of the look, the islands are those of another one. Their surface stays until they are found.
  // What was wanted before is asked for again then.
  if (scene_.look.threshold_hu) {
    wanted_.reset();
    if (soft_->isChecked() && !has_soft_) pause_.start();
    return;
  }
  KeptParts now = kept();
  if (now == wanted_) return;
  wanted_ = std::move(now);
  pause_.start();
}

void ImagingSolid::ask() {
  if (!scene_.open() || !isVisible()) return;
  auto job = std::make_unique<Job>();
  job->kept = kept();
  job->surface = !scene_.look.threshold_hu && job->kept != shown_;
  job->soft = soft_->isChecked() && !has_soft_;
  if (maker_) {
    // A surface that nobody wants any more is cancelled too.
    const bool covers = (job_->surface ? job_->kept == job->kept : !job->surface) && (!job->soft || job_->soft);
    if (!covers) job_->cancelled = true;
    return;
  }
  if (job->surface || job->soft) make(std::move(job));
  show_state();
}

void ImagingSolid::make(std::unique_ptr<Job> job) {
  job_ = std::move(job);
  // Neither the scan nor the islands change before release().
  maker_.reset(QThread::create([&scene = scene_, &of = *job_] {
    const KeepGoing keep_going = [&of](double /*fraction*/) { return !of.cancelled; };
    if (of.surface) of.bones = kept_surfaces(scene.scan.geometry, scene.islands, of.kept, keep_going);
    if (of.soft) of.hu = reduced_scan(scene.scan, keep_going);
  }));
  connect(maker_.get(), &QThread::finished, this, [this, number = ++jobs_] {
    if (number != jobs_ || !maker_) return;  // it was released meanwhile
    maker_.release()->deleteLater();
    const std::unique_ptr<Job> done = std::move(job_);
    if (!done->cancelled) take(*done);
    ask();
    show_state();
  });
  maker_->start();
}

void ImagingSolid::take(Job& done) {
  if (done.surface) {
    shown_ = std::move(done.kept);
    problem_ = done.bones ? QString() : tr("This surface is too large. Take a higher threshold, or smooth the scan.");
    const std::vector<KeptSurface> bones = done.bones ? std::move(*done.bones) : std::vector<KeptSurface>();
    has_surface_ = !bones.empty();
    SolidBones& shown = view_->scene().bones();
    shown.clear();
    tints_.clear();
    for (const KeptSurface& of : bones) {
      shown.show(of.bone, of.mesh);
      tints_[of.bone];
    }
    const Box bounds = has_surface_ ? points_of(bones) : corners_of(scene_.scan.geometry);
    mark_mm_ = kMarkShare * bounds.size_mm().norm();
    show_tints();
    show_marks(true);
    view_->set_bounds(bounds);
  }
  if (done.soft && soft_->isChecked()) {
    has_soft_ = true;
    if (done.hu) view_->scene().show_soft_tissue(grid_of(done.hu->geometry), done.hu->values);
  }
  view_->redraw();
}

void ImagingSolid::show_cross() {
  if (cross_ == scene_.crosshair) return;
  cross_ = scene_.crosshair;
  view_->scene().show_cross(grid_of(scene_.scan.geometry), scene_.crosshair);
  view_->redraw(true);
}

void ImagingSolid::show_tints() {
  for (auto& [bone, shown] : tints_) {
    const Tint& tint = scene_.look.bones[static_cast<std::size_t>(bone)];
    if (tint == shown) continue;
    shown = tint;
    view_->scene().bones().set_paint(bone, {tint.red, tint.green, tint.blue}, opacity_of(tint));
    view_->redraw();
  }
}

void ImagingSolid::show_marks(bool all) {
  std::array<std::vector<Vec3>, 3> now;
  for (const ImagingScene::SeedMark& seed : scene_.seeds)
    now[static_cast<std::size_t>(seed.outside ? SolidMark::outside : SolidMark::seed)].push_back(
        centre_of(scene_.scan.geometry, seed.voxel));
  now[static_cast<std::size_t>(SolidMark::paint)] = painted_points(scene_.look.corrections, 2.0 * mark_mm_);
  for (std::size_t kind = 0; kind < now.size(); ++kind) {
    if (!all && now[kind] == marks_[kind]) continue;
    marks_[kind] = std::move(now[kind]);
    view_->scene().marks().show(static_cast<SolidMark>(kind), marks_[kind], mark_mm_);
    view_->redraw();
  }
}

void ImagingSolid::show_boxes() {
  const int chosen = scene_.boxes ? scene_.boxes->section_at(scene_.crosshair) : -1;
  if (boxes_ == scene_.boxes && chosen_ == chosen) return;
  boxes_ = scene_.boxes;
  chosen_ = chosen;
  std::vector<WireBox> wires;
  if (boxes_)
    for (const DrawnBox& box : drawn_boxes(*boxes_, chosen))
      wires.push_back({box.first, box.last, box.colour, box.wide, box.dashed});
  view_->scene().show_boxes(grid_of(scene_.scan.geometry), wires);
  view_->redraw();
}

void ImagingSolid::show_state() {
  const bool older = scene_.look.threshold_hu.has_value() && has_surface_;
  const bool making = maker_ != nullptr && job_->surface;
  const QString notice = older    ? tr("The parts that were found last")
                         : making ? tr("Being made …")
                                  : QString(problem_).replace(". ", ".\n");
  if (notice != notice_) {
    notice_ = notice;
    view_->scene().show_notice(notice.toStdString());
    view_->redraw(true);
  }
  // Until something is to be seen, no time goes into drawing.
  const bool something = has_surface_ || view_->scene().has_soft_tissue();
  if (!something)
    hint_->setText(!problem_.isEmpty() ? problem_
                   : maker_ != nullptr ? tr("Being made …")
                                       : tr("What you keep appears here in three dimensions."));
  if (!something && view_->hasFocus()) soft_->setFocus();
  stack_->setCurrentWidget(something ? static_cast<QWidget*>(view_) : hint_);
}

void ImagingSolid::paintEvent(QPaintEvent* event) {
  QWidget::paintEvent(event);
  if (!view_->hasFocus()) return;
  QPainter painter(this);
  painter.setPen(kFocusFrame);
  painter.drawRect(rect().adjusted(0, 0, -1, -1));
}

void ImagingSolid::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  ask();
}

}  // namespace osteon
