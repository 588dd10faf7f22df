#include "viewer_client/desktop/solid_view.hpp"

#include <QApplication>
#include <QKeyEvent>
#include <QMouseEvent>
#include <algorithm>
#include <cmath>
#include <utility>

#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkRenderWindowInteractor.h>

namespace osteon {

namespace {

constexpr double kTurnRadPerPixel = 0.008, kTurnOfKey_rad = 0.15, kNearerOfNotch = 0.85, kWheelNotch = 120.0;
constexpr double kAsideOfKey = 0.05;  // of the picture's height
constexpr std::chrono::milliseconds kLeastFrame{16}, kAtRest{250};

}  // namespace

SolidView::SolidView(Events events, QWidget* parent) : QVTKOpenGLNativeWidget(parent), events_(std::move(events)) {
  setFormat(QVTKOpenGLNativeWidget::defaultFormat());
  vtkNew<vtkGenericOpenGLRenderWindow> window;
  setRenderWindow(window);
  // VTK's own style would turn and zoom too.
  window->GetInteractor()->SetInteractorStyle(nullptr);
  scene_ = std::make_unique<SolidScene>(*window);
  setObjectName("solid_view");
  setAccessibleName(tr("Three dimensions"));
  setFocusPolicy(Qt::StrongFocus);
  setToolTip(tr("A click chooses the bone in the list.") + '\n' +
             tr("A double click or Enter moves the crosshair too.") + '\n' +
             tr("A drag turns the picture, the wheel brings it nearer, and Home shows all."));
  frame_timer_.setSingleShot(true);
  connect(&frame_timer_, &QTimer::timeout, this, [this] { draw(); });
  rest_timer_.setSingleShot(true);
  rest_timer_.setInterval(kAtRest);
  connect(&rest_timer_, &QTimer::timeout, this, [this] { redraw(); });
}

SolidView::~SolidView() {
  makeCurrent();
  scene_.reset();
}

void SolidView::set_bounds(const Box& bounds) {
  bounds_ = bounds;
  if (whole_) look_whole(camera());
  redraw();
}

void SolidView::look_overview() {
  whole_ = true;
  look_whole(overview(bounds_));
  redraw();
}

void SolidView::redraw(bool moving) {
  moving_ = moving_ || moving;
  if (frame_timer_.isActive()) return;
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_frame_ - std::chrono::steady_clock::now());
  frame_timer_.start(std::max(std::chrono::milliseconds(0), wait));
}

void SolidView::draw() {
  if (!isVisible() || !isValid() || drawing_) return;
  drawing_ = true;
  const auto begin = std::chrono::steady_clock::now();
  const bool coarse = scene_->has_soft_tissue() && (moving_ || rest_timer_.isActive());
  moving_ = false;
  scene_->draw(coarse);
  if (coarse) rest_timer_.start();  // from now on, because the picture may take longer than the pause
  ++frames_;
  coarse_frames_ += coarse ? 1 : 0;
  const auto end = std::chrono::steady_clock::now();
  // Where drawing is slow, leave a third of the time to the mouse and to the other programs of this machine.
  next_frame_ = std::max(begin + kLeastFrame, end + (end - begin) / 2);
  drawing_ = false;
}

void SolidView::move(const CameraView& view) {
  whole_ = false;
  scene_->look(view);
  redraw(true);
}

void SolidView::look_whole(const CameraView& from) {
  if (bounds_.empty()) return;
  scene_->look(fitted(from, bounds_, static_cast<double>(std::max(1, width())) / std::max(1, height())));
}

void SolidView::choose(const QPoint& at, bool point) {
  const double ratio = devicePixelRatioF();
  const auto hit = scene().bone_at(static_cast<int>((at.x() + 0.5) * ratio), static_cast<int>((at.y() + 0.5) * ratio));
  if (!hit) return;
  events_.bone(*hit);
  if (point) events_.point(*hit);
}

// A picture that was asked for before there was a context was not drawn.
void SolidView::initializeGL() {
  QVTKOpenGLNativeWidget::initializeGL();
  redraw();
}

void SolidView::resizeEvent(QResizeEvent* event) {
  QVTKOpenGLNativeWidget::resizeEvent(event);
  if (whole_) look_whole(camera());
  redraw();
}

void SolidView::showEvent(QShowEvent* event) {
  QVTKOpenGLNativeWidget::showEvent(event);
  redraw();
}

void SolidView::mousePressEvent(QMouseEvent* event) {
  last_ = event->pos();
  clicking_ = event->button() == Qt::LeftButton;
}

void SolidView::mouseReleaseEvent(QMouseEvent* event) {
  if (std::exchange(clicking_, false) && event->button() == Qt::LeftButton) choose(event->pos(), false);
}

void SolidView::mouseMoveEvent(QMouseEvent* event) {
  const QPoint by = event->pos() - last_;
  // A hand on the mouse trembles.
  if (clicking_ && by.manhattanLength() < QApplication::startDragDistance()) return;
  clicking_ = false;
  last_ = event->pos();
  if ((event->buttons() & Qt::LeftButton) != 0 && (event->modifiers() & Qt::ShiftModifier) == 0)
    return move(orbited(camera(), kTurnRadPerPixel * by.x(), -kTurnRadPerPixel * by.y()));
  const double height_px = std::max(1, height());
  if ((event->buttons() & (Qt::LeftButton | Qt::MiddleButton)) != 0)
    return move(shifted(camera(), by.x() / height_px, -by.y() / height_px));
}

void SolidView::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) choose(event->pos(), true);
}

void SolidView::wheelEvent(QWheelEvent* event) {
  event->accept();
  move(zoomed(camera(), std::pow(kNearerOfNotch, event->angleDelta().y() / kWheelNotch)));
}

void SolidView::keyPressEvent(QKeyEvent* event) {
  const auto arrow = [&](int right, int up) {
    move((event->modifiers() & Qt::ShiftModifier) != 0
             ? shifted(camera(), kAsideOfKey * right, kAsideOfKey * up)
             : orbited(camera(), kTurnOfKey_rad * right, kTurnOfKey_rad * up));
  };
  switch (event->key()) {
    case Qt::Key_Left:
      return arrow(-1, 0);
    case Qt::Key_Right:
      return arrow(1, 0);
    case Qt::Key_Up:
      return arrow(0, 1);
    case Qt::Key_Down:
      return arrow(0, -1);
    case Qt::Key_Plus:
    case Qt::Key_PageUp:
      return move(zoomed(camera(), kNearerOfNotch));
    case Qt::Key_Minus:
    case Qt::Key_PageDown:
      return move(zoomed(camera(), 1.0 / kNearerOfNotch));
    case Qt::Key_Home:
      return look_overview();
    case Qt::Key_Return:
    case Qt::Key_Enter:
      return choose(rect().center(), true);
    default:
      event->ignore();  // not VTK's keys: the window has its own
  }
}

void SolidView::focusInEvent(QFocusEvent* event) {
  QVTKOpenGLNativeWidget::focusInEvent(event);
  events_.focused();
}

void SolidView::focusOutEvent(QFocusEvent* event) {
  QVTKOpenGLNativeWidget::focusOutEvent(event);
  events_.focused();
}

}  // namespace osteon
