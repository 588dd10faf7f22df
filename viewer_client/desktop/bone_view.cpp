#include "viewer_client/desktop/bone_view.hpp"

#include <QKeyEvent>
#include <QMouseEvent>
#include <QSurfaceFormat>
#include <QTabletEvent>
#include <algorithm>
#include <cmath>
#include <utility>

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderWindowInteractor.h>

#include "viewer_client/desktop/structure_names.hpp"
#include "viewer_client/scene/held_tools.hpp"

namespace osteon {

namespace {

constexpr double kRadPerPixel = 0.008, kZoomPerNotch = 0.85, kNewtonsPerNotch = 1.0, kNotch = 120.0;
constexpr std::chrono::milliseconds kFrame{16};
constexpr int kClick_px = 4;  // a longer way is a drag
constexpr double kToolDistance_mm = 120.0;
// A camera that went after each motion of the tool would make the bone tremble.
constexpr double kFollowed_mm = 20.0;

}  // namespace

BoneView::BoneView(QWidget* parent) : QVTKOpenGLNativeWidget(parent) {
  setFormat(QVTKOpenGLNativeWidget::defaultFormat());
  vtkNew<vtkGenericOpenGLRenderWindow> window;
  setRenderWindow(window);
  // VTK's own style would turn and zoom at each drag and notch too, also while the tool pushes, and draw each time.
  window->GetInteractor()->SetInteractorStyle(nullptr);
  scene_ = std::make_unique<BoneScene>(*window);
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  frame_timer_.setSingleShot(true);
  connect(&frame_timer_, &QTimer::timeout, this, [this] { draw(); });
}

BoneView::~BoneView() {
  updater_.reset();
  makeCurrent();
  scene_.reset();
}

void BoneView::show_room(RenderQueue* queue, const Box& bounds) {
  updater_.reset();
  surface_shown_ = false;
  makeCurrent();
  scene_.reset();
  scene_ = std::make_unique<BoneScene>(*renderWindow());
  scene_->name_axes([](const std::string& name) { return structure_title(name).toStdString(); });
  scene_->show_marker(marker_);
  scene_->show_planned(planned_);
  scene_->show_risks(risks_);
  (void)scene_->set_stereo(stereo_);
  clipping_.clear();
  annotations_.clear();
  bounds_ = bounds;
  if (queue != nullptr) updater_.emplace(*queue, *scene_);
  look_overview();
  following_ = follows_;
  redraw();
}

void BoneView::arrived() {
  if (!updater_) return;
  const bool changed = updater_->update(true);
  (void)updater_->take_arrivals();  // for a log that this window does not write
  if (changed) redraw();
}

void BoneView::set_holding(bool on) {
  holding_ = on;
  placing_ = placing_ && !on;
  if (!on) {
    lift_pen();
    pointer_.put_down();
  }
  pointer_moved();
}

void BoneView::set_placing(bool on) {
  placing_ = on;
  if (on) set_holding(false);
  setCursor(on ? Qt::CrossCursor : Qt::ArrowCursor);
}

void BoneView::redraw() {
  if (frame_timer_.isActive()) return;
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_frame_ - std::chrono::steady_clock::now());
  frame_timer_.start(std::max(std::chrono::milliseconds(0), wait));
}

void BoneView::draw() {
  if (!isVisible() || drawing_) return;
  drawing_ = true;
  const auto begin = std::chrono::steady_clock::now();
  if (updater_) scene_->show_tools(updater_->states());
  follow_tool();
  QString notice = notice_;
  if (updater_)
    if (const auto percent = updater_->percent_received()) notice = tr("Receiving the surface, %1 %").arg(*percent);
  scene_->show_text({}, notice.toStdString());
  scene_->draw();
  ++frames_;
  const auto end = std::chrono::steady_clock::now();
  // Where drawing is slow, leave a third of the time to the other programs of this machine.
  next_frame_ = std::max(begin + kFrame, end + (end - begin) / 2);
  surface_shown_ = updater_ && updater_->complete();
  drawing_ = false;
}

void BoneView::look(const CameraView& view) {
  following_ = whole_ = false;
  scene_->look(view);
  camera_moved();
}

CameraView BoneView::camera() const { return scene_->camera(); }

void BoneView::look_whole(const CameraView& from) {
  const int pictures = stereo_ == StereoMode::side_by_side ? 2 : 1;
  const bool following = following_;
  look(fitted(from, bounds_, static_cast<double>(std::max(1, width())) / (pictures * std::max(1, height()))));
  following_ = following;
  whole_ = true;
}

void BoneView::look_overview() {
  following_ = false;
  look_whole(overview(bounds_));
}

void BoneView::look_from(const Vec3& side) {
  CameraView view = overview(bounds_);
  view.eye_mm = view.target_mm + side.normalized();
  view.up = std::abs(side.normalized().z()) < 0.9 ? Vec3(Vec3::UnitZ()) : Vec3(-Vec3::UnitY());
  following_ = false;
  look_whole(view);
}

void BoneView::look_tool() {
  if (const CuttingState* held = held_tool()) look(beside_tool(held->pose_bone_tool, kToolDistance_mm));
  following_ = follows_;
}

void BoneView::set_following(bool on) { follows_ = following_ = on; }

void BoneView::follow_cap(const SpaceMouseState& cap, double dt_s) {
  constexpr double kRest = 0.05, kFastest_rad_per_s = 1.0;
  const Vec3 push = beyond_rest(cap.push, kRest), twist = beyond_rest(cap.twist, kRest);
  if (push.isZero() && twist.isZero()) return;
  if (!holding_) return look(held_by_cap(camera(), push, twist, dt_s));
  pointer_.twist(camera(), kFastest_rad_per_s * dt_s * twist);
  if (!push.isZero()) look(held_by_cap(camera(), push, Vec3::Zero(), dt_s));
  pointer_moved();
}

void BoneView::follow_pad(const GamePadCommand& command, double dt_s) {
  if (!command.used) return;
  constexpr double kFastest_rad_per_s = 1.2, kShift_per_s = 0.4, kFine = 0.1;
  const double scale = command.fine ? kFine : 1.0;
  const Eigen::Vector2d turn_rad = scale * kFastest_rad_per_s * dt_s * command.turn;
  if (!holding_) {
    const Eigen::Vector2d shift = scale * kShift_per_s * dt_s * command.slide;
    if (!turn_rad.isZero()) look(orbited(camera(), turn_rad.x(), turn_rad.y()));
    if (!shift.isZero()) look(shifted(camera(), shift.x(), shift.y()));
    return;
  }
  if (command.spindle) pointer_.set_spindle(*command.spindle);
  if (command.toggles_spindle) pointer_.set_spindle(!pointer_.spindle());
  if (!updater_ || (pointer_.pushing() && !pad_pushes_)) return pointer_moved();  // the mouse or the pen is at work
  pad_leads_ = true;
  pointer_.set_source(PointerSource::game_pad);
  if (command.fine != pad_fine_) pointer_.set_fine(pad_fine_ = command.fine);
  // A hand that pushes keeps its axis.
  if (!pad_pushes_ && !turn_rad.isZero()) pointer_.turn(camera(), turn_rad.x(), turn_rad.y());
  if (!command.slide.isZero() || (command.push_begins && !pointer_.on_bone())) {
    // While the hand pushes, it makes fine motions a tenth by itself.
    const Eigen::Vector2d slide = (pad_pushes_ ? 1.0 : scale) * command.slide;
    pointer_.slide(camera(), slide.x(), slide.y(), dt_s, updater_->surface());
    if (!is_drawn(clipping_, pointer_.input().target_mm)) pointer_.leave();
  }
  // A push that the window has ended begins again with the next pull of the trigger.
  if (command.push_begins) pad_pushes_ = begin_pen_push();
  if (pad_pushes_ && command.push) pointer_.set_push(command.push_n);
  if (pad_pushes_ && !command.push) lift_pen();
  pointer_moved();
}

void BoneView::pad_gone() {
  if (!pad_leads_) return;
  if (pad_pushes_) lift_pen();
  pointer_.set_fine(pad_fine_ = false);
  if (!underMouse()) pointer_.leave();
  pad_leads_ = false;
  pointer_moved();
}

const CuttingState* BoneView::held_tool() const {
  if (!updater_) return nullptr;
  return first_held(updater_->states(), events_.people ? events_.people() : std::vector<PersonSeen>());
}

void BoneView::follow_tool() {
  const CuttingState* held = following_ ? held_tool() : nullptr;
  if (held == nullptr) return;
  const Pose& tool = held->pose_bone_tool;
  const CameraView now = camera();
  const bool near = (now.target_mm - tool.position_mm).norm() <= kFollowed_mm;
  if (!near || (now.eye_mm - now.target_mm).norm() > 1.01 * kToolDistance_mm) look_tool();
}

void BoneView::set_notice(const QString& notice) {
  notice_ = notice;
  redraw();
}

void BoneView::show_marker(bool on) {
  marker_ = on;
  scene_->show_marker(on);
  redraw();
}

void BoneView::show_planned(bool on) {
  planned_ = on;
  scene_->show_planned(on);
  redraw();
}

void BoneView::show_risks(bool on) {
  risks_ = on;
  scene_->show_risks(on);
  redraw();
}

void BoneView::clip(const Clipping& visible) {
  clipping_ = visible;
  scene_->clip(visible);
  redraw();
}

void BoneView::show_annotations(const std::vector<Annotation>& drawn) {
  if (drawn == annotations_) return;
  annotations_ = drawn;
  scene_->show_annotations(annotations_);
  redraw();
}

bool BoneView::set_stereo(StereoMode mode) {
  const bool has = scene_->set_stereo(mode);
  stereo_ = scene_->stereo();
  if (whole_) look_whole(camera());  // each picture has half of the width side by side
  redraw();
  return has;
}

void BoneView::camera_moved() {
  redraw();
  if (events_.looked && width() > 0 && height() > 0) events_.looked(look_of(camera(), width(), height()));
}

void BoneView::pointer_moved() {
  if (events_.pointed) events_.pointed();
}

void BoneView::point_at(const QPoint& at) {
  if (!updater_) return;
  pointer_.move(sight(at), updater_->surface());
  // What is not drawn is still there, but nobody points at what he does not see.
  if (!is_drawn(clipping_, pointer_.input().target_mm)) pointer_.leave();
}

SightRay BoneView::sight(const QPoint& at) const {
  if (stereo_ != StereoMode::side_by_side) return ray_through(camera(), width(), height(), at.x(), at.y());
  const int half = std::max(1, width() / 2);
  const bool right = at.x() >= half;
  const CameraView eye = right ? right_eye(camera()) : left_eye(camera());
  return ray_through(eye, half, height(), right ? at.x() - half : at.x(), at.y());
}

void BoneView::turn_camera(const QPoint& by, Qt::KeyboardModifiers keys) {
  if (keys & Qt::ShiftModifier)
    look(shifted(camera(), static_cast<double>(by.x()) / height(), -static_cast<double>(by.y()) / height()));
  else
    look(orbited(camera(), kRadPerPixel * by.x(), -kRadPerPixel * by.y()));
}

void BoneView::resizeEvent(QResizeEvent* event) {
  QVTKOpenGLNativeWidget::resizeEvent(event);
  if (whole_) look_whole(camera());
  camera_moved();
}

void BoneView::mousePressEvent(QMouseEvent* event) {
  last_ = pressed_ = event->pos();
  second_click_ = event->type() == QEvent::MouseButtonDblClick;
  if (pad_pushes_ && event->button() == Qt::LeftButton) return;  // two hands do not push at one tool
  camera_drag_ = event->button() == Qt::MiddleButton || !holding_;
  if (!holding_ || event->button() != Qt::LeftButton) return;
  pointer_.set_source(PointerSource::mouse);
  point_at(event->pos());
  // Beside the bone there is nothing to push at. Then the button turns the bone.
  camera_drag_ = !pointer_.press();
  if (!camera_drag_ && events_.pressed) events_.pressed();
  pointer_moved();
}

void BoneView::mouseMoveEvent(QMouseEvent* event) {
  const QPoint by = event->pos() - last_;
  last_ = event->pos();
  if (camera_drag_ && event->buttons() != Qt::NoButton) {
    if ((event->buttons() & Qt::RightButton) && !(event->buttons() & (Qt::LeftButton | Qt::MiddleButton)))
      look(zoomed(camera(), std::pow(kZoomPerNotch, -by.y() / 20.0)));
    else
      turn_camera(by, event->modifiers());
    return;
  }
  if (!holding_ || pad_pushes_) return;
  pad_leads_ = false;
  pointer_.set_source(PointerSource::mouse);
  pointer_.set_fine(event->modifiers() & Qt::ShiftModifier);
  if (event->buttons() & Qt::RightButton) {
    if (event->modifiers() & Qt::ControlModifier)
      pointer_.roll(kRadPerPixel * by.x());
    else
      pointer_.turn(camera(), kRadPerPixel * by.x(), -kRadPerPixel * by.y());
  } else {
    point_at(event->pos());
  }
  pointer_moved();
}

void BoneView::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton && pointer_.pushing() && !pad_pushes_) {
    lift_pen();
    point_at(event->pos());
    pointer_moved();
  }
  // The second click of a double click is not for a second item in the same hole.
  if (event->button() == Qt::LeftButton && placing_ && !second_click_ &&
      (event->pos() - pressed_).manhattanLength() <= kClick_px) {
    const SightRay ray = sight(event->pos());
    const auto hit = updater_ ? updater_->surface().first_hit(ray.from_mm, ray.direction) : std::nullopt;
    if (hit && is_drawn(clipping_, hit->point_mm) && events_.clicked) events_.clicked(*hit);
  }
  if (event->buttons() == Qt::NoButton) camera_drag_ = false;
}

// The pen's tip on the tablet is the button, and its pressure the push. What is ignored here comes back as an event of
// the mouse: the pen's other buttons, and the pen without a tool or beside the bone.
void BoneView::tabletEvent(QTabletEvent* event) {
  event->ignore();
  const QPoint at = event->pos();
  const bool lifted = event->type() == QEvent::TabletRelease && event->button() == Qt::LeftButton && wheel_push_n_;
  if (!holding_ || camera_drag_ || pad_pushes_) return;
  // A button at the pen's side turns the bone. The tip may be lifted while it is still down.
  if (!lifted && (event->buttons() & ~Qt::MouseButtons(Qt::LeftButton)) != Qt::NoButton) return;
  if (event->type() == QEvent::TabletRelease) {
    if (!wheel_push_n_) return;
    lift_pen();
    point_at(at);
  } else {
    last_ = at;
    pointer_.set_source(PointerSource::pen);
    pointer_.set_fine(event->modifiers() & Qt::ShiftModifier);
    point_at(at);
    if (event->type() == QEvent::TabletPress && event->button() == Qt::LeftButton) {
      if (!begin_pen_push()) return;
    }
    if (wheel_push_n_) pointer_.set_push(kLeastPush_n + event->pressure() * (kMostPush_n - kLeastPush_n));
  }
  event->accept();
  pointer_moved();
}

bool BoneView::begin_pen_push() {
  if (!pointer_.press()) return false;
  wheel_push_n_ = pointer_.push_n();
  if (events_.pressed) events_.pressed();
  return true;
}

void BoneView::lift_pen() {
  pad_pushes_ = false;
  pointer_.release();
  if (wheel_push_n_) pointer_.set_push(*wheel_push_n_);
  wheel_push_n_.reset();
}

void BoneView::wheelEvent(QWheelEvent* event) {
  const double notches = event->angleDelta().y() / kNotch;
  const bool sets_push = holding_ && pointer_.on_bone() && !(event->modifiers() & Qt::ControlModifier);
  if (sets_push) {
    pointer_.add_push(kNewtonsPerNotch * notches);
    pointer_moved();
  } else {
    look(zoomed(camera(), std::pow(kZoomPerNotch, notches)));
  }
  event->accept();
}

void BoneView::leaveEvent(QEvent* event) {
  QVTKOpenGLNativeWidget::leaveEvent(event);
  if (pad_leads_) return;
  pointer_.leave();
  pointer_moved();
}

void BoneView::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Space && holding_ && !event->isAutoRepeat()) {
    pointer_.set_spindle(!pointer_.spindle());
    pointer_moved();
    return;
  }
  if (event->key() == Qt::Key_Shift) {
    pointer_.set_fine(true);
    pointer_moved();
  }
  // Not VTK's keys: the menus have their own.
  event->ignore();
}

void BoneView::keyReleaseEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Shift) {
    pointer_.set_fine(false);
    pointer_moved();
  }
  event->ignore();
}

void BoneView::focusOutEvent(QFocusEvent* event) {
  QVTKOpenGLNativeWidget::focusOutEvent(event);
  // A hand that the user cannot see any more must not push on.
  lift_pen();
  pointer_moved();
}

}  // namespace osteon
