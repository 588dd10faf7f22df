#include "viewer_client/desktop/imaging_plane.hpp"

#include <QImage>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QSlider>
#include <QVBoxLayout>
#include <QWheelEvent>
#include <algorithm>
#include <utility>

#include "viewer_client/desktop/edge_letters.hpp"

namespace osteon {

namespace {

constexpr int kPlaneMargin_px = 4, kPage = 10;
constexpr int kWheelStep = 120;  // of Qt, for one notch
constexpr QColor kCrosshair{90, 230, 140, 170}, kLetter{250, 220, 120}, kBoxEdge{90, 200, 255}, kOutside{255, 60, 60};
constexpr QColor kBrush{255, 255, 255, 200};
constexpr QColor kLandmark{255, 120, 230};
constexpr double kWideBox_px = 3.0;
constexpr double kSeedMark_px = 4.0, kLandmark_px = 4.0;

const char* name_of(Plane plane) {
  return plane == Plane::axial ? "axial" : plane == Plane::coronal ? "coronal" : "sagittal";
}

QString title_of(Plane plane) {
  switch (plane) {
    case Plane::coronal:
      return QCoreApplication::translate("ImagingPlane", "Coronal plane");
    case Plane::sagittal:
      return QCoreApplication::translate("ImagingPlane", "Sagittal plane");
    default:
      return QCoreApplication::translate("ImagingPlane", "Axial plane");
  }
}

}  // namespace

ImagingPlane::ImagingPlane(Plane plane, const ImagingScene& scene, Events events, QWidget* parent)
    : QWidget(parent), plane_(plane), scene_(scene), events_(std::move(events)) {
  setObjectName(QString("plane_") + name_of(plane));
  setAccessibleName(title_of(plane));
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setToolTip(tr("Left: the tool. Enter, or double click with Crosshair: keep. Right drag: window. Wheel: slices."));
  slider_ = new QSlider(Qt::Vertical);
  slider_->setObjectName(QString("slice_") + name_of(plane));
  slider_->setAccessibleName(tr("%1: slice").arg(title_of(plane)));
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->addStretch();
  row->addWidget(slider_);
  connect(slider_, &QSlider::valueChanged, this, [this](int slice) { go_to_slice(slice); });
}

void ImagingPlane::begin() {
  axes_ = axes_of(scene_.scan.geometry, plane_);
  dragging_ = false;
  const QSignalBlocker quiet(slider_);
  slider_->setRange(0, axes_.slices - 1);
  slider_->setPageStep(kPage);
  refresh();
}

void ImagingPlane::refresh() {
  if (!scene_.open() && !scene_.waits()) return;
  drawn_slice_ = -1;
  const QSignalBlocker quiet(slider_);
  slider_->setValue(slice());
  update();
}

int ImagingPlane::slice() const { return place_in(axes_, scene_.crosshair)[2]; }

PlaneFrame ImagingPlane::frame() const { return fit(axes_, width() - slider_->width() - kPlaneMargin_px, height()); }

QPoint ImagingPlane::pixel(const std::array<int, 3>& voxel) const {
  const auto [column, row, slice] = place_in(axes_, voxel);
  const auto [x, y] = pixel_of(axes_, frame(), column, row);
  return {static_cast<int>(x), static_cast<int>(y)};
}

std::array<int, 3> ImagingPlane::voxel_under(const QPoint& at) const {
  const auto [column, row] = under(axes_, frame(), at.x() + 0.5, at.y() + 0.5);
  return voxel_at(axes_, column, row, slice());
}

std::vector<std::uint32_t> ImagingPlane::draw() const {
  if (scene_.open()) return draw_plane(scene_.scan, scene_.islands, axes_, slice(), scene_.look, scene_.greys);
  return draw_plane(scene_.first, {}, axes_of(scene_.first.geometry, plane_), 0, scene_.look, scene_.greys);
}

void ImagingPlane::paintEvent(QPaintEvent* /*event*/) {
  QPainter painter(this);
  const PlaneFrame at = frame();
  const QRectF all(0, 0, width() - slider_->width() - kPlaneMargin_px, height());
  painter.fillRect(all, Qt::black);
  if (!shows()) {
    painter.setPen(kLetter);
    if (scene_.waits()) painter.drawText(all, Qt::AlignCenter | Qt::TextWordWrap, tr("Waits for the other slices"));
    return;
  }
  if (drawn_slice_ != slice()) {
    pixels_ = draw();
    drawn_slice_ = slice();
  }
  const QImage image(reinterpret_cast<const uchar*>(pixels_.data()), axes_.columns, axes_.rows,
                     axes_.columns * static_cast<int>(sizeof(std::uint32_t)), QImage::Format_RGB32);
  const QRectF picture(at.left_px, at.top_px, at.width_px, at.height_px);
  painter.setRenderHint(QPainter::SmoothPixmapTransform);
  painter.drawImage(picture, image);
  paint_boxes(painter, at);
  paint_marks(painter, at);
  paint_landmarks(painter, at);
  // Below the title, which may reach the middle.
  paint_edge_letters(painter, all.toRect().adjusted(0, painter.fontMetrics().height(), 0, 0),
                     letters_of(axes_, scene_.scan.geometry));
  painter.setPen(kLetter);
  const QRectF inside = all.adjusted(kPlaneMargin_px, kPlaneMargin_px, -kPlaneMargin_px, -kPlaneMargin_px);
  painter.drawText(inside, Qt::AlignLeft | Qt::AlignTop,
                   tr("%1, %2 of %3").arg(title_of(plane_)).arg(slice() + 1).arg(axes_.slices));
  if (hasFocus()) {
    painter.setPen(kLetter);
    painter.drawRect(all.adjusted(0, 0, -1, -1));
  }
}

void ImagingPlane::paint_marks(QPainter& painter, const PlaneFrame& at) const {
  const auto [column, row, through] = place_in(axes_, scene_.crosshair);
  const auto [x, y] = pixel_of(axes_, at, column, row);
  painter.setPen(kCrosshair);
  painter.drawLine(QPointF(at.left_px, y), QPointF(at.left_px + at.width_px, y));
  painter.drawLine(QPointF(x, at.top_px), QPointF(x, at.top_px + at.height_px));
  const double voxel_px = at.width_px / axes_.columns;
  if (scene_.look.box) {
    const VoxelRange range = range_of(scene_.scan.geometry, scene_.look.box);
    painter.setPen(kBoxEdge);
    painter.drawRect(rectangle(at, range.first, range.last));
  }
  for (const ImagingScene::SeedMark& seed : scene_.seeds) {
    const auto place = place_in(axes_, seed.voxel);
    if (place[2] != through) continue;
    const auto middle = pixel_of(axes_, at, place[0], place[1]);
    const QPointF point(middle[0], middle[1]);
    painter.setPen(seed.outside ? kOutside : kLetter);
    // A shape of its own, as in three dimensions: not everybody sees the colours.
    if (seed.outside)
      painter.drawPolygon(QPolygonF({point + QPointF(0.0, -kSeedMark_px), point + QPointF(kSeedMark_px, kSeedMark_px),
                                     point + QPointF(-kSeedMark_px, kSeedMark_px)}));
    else
      painter.drawEllipse(point, kSeedMark_px, kSeedMark_px);
  }
  if (!hovered_ || !has_brush()) return;
  const double radius_px = scene_.brush_mm / axes_.right_mm * voxel_px;
  painter.setPen(kBrush);
  painter.drawEllipse(QPointF(*hovered_), radius_px, radius_px);
}

QRectF ImagingPlane::rectangle(const PlaneFrame& at, const std::array<int, 3>& first,
                               const std::array<int, 3>& last) const {
  const auto from = place_in(axes_, first), to = place_in(axes_, last);
  const auto a = pixel_of(axes_, at, std::min(from[0], to[0]), std::min(from[1], to[1]));
  const auto b = pixel_of(axes_, at, std::max(from[0], to[0]), std::max(from[1], to[1]));
  const double half_px = 0.5 * at.width_px / axes_.columns, half_row_px = 0.5 * at.height_px / axes_.rows;
  return {QPointF(a[0] - half_px, a[1] - half_row_px), QPointF(b[0] + half_px, b[1] + half_row_px)};
}

void ImagingPlane::paint_boxes(QPainter& painter, const PlaneFrame& at) const {
  if (!scene_.boxes) return;
  for (const DrawnBox& box : drawn_boxes(*scene_.boxes, scene_.boxes->section_at(scene_.crosshair))) {
    const int first = place_in(axes_, box.first)[2], last = place_in(axes_, box.last)[2];
    if (slice() < std::min(first, last) || slice() > std::max(first, last)) continue;
    painter.setPen(QPen(QColor(box.colour[0], box.colour[1], box.colour[2]), box.wide ? kWideBox_px : 1.0,
                        box.dashed ? Qt::DashLine : Qt::SolidLine));
    painter.drawRect(rectangle(at, box.first, box.last));
  }
}

void ImagingPlane::paint_landmarks(QPainter& painter, const PlaneFrame& at) const {
  painter.setPen(kLandmark);
  for (const ImagingScene::LandmarkMark& mark : scene_.landmarks) {
    const auto place = place_in(axes_, mark.voxel);
    if (place[2] != slice()) continue;
    const auto [x, y] = pixel_of(axes_, at, place[0], place[1]);
    painter.drawLine(QPointF(x - kLandmark_px, y - kLandmark_px), QPointF(x + kLandmark_px, y + kLandmark_px));
    painter.drawLine(QPointF(x - kLandmark_px, y + kLandmark_px), QPointF(x + kLandmark_px, y - kLandmark_px));
    painter.drawText(QPointF(x + 2 * kLandmark_px, y - kLandmark_px), mark.name);
  }
}

void ImagingPlane::begin_drag(const std::array<int, 3>& voxel) { dragging_ = events_.begin_drag(axes_, voxel); }

void ImagingPlane::end_drag(bool keep) {
  if (!std::exchange(dragging_, false)) return;
  events_.end_drag(keep);
}

void ImagingPlane::mousePressEvent(QMouseEvent* event) {
  dragged_from_ = event->pos();
  if (!scene_.open() || event->button() != Qt::LeftButton) return;
  if (scene_.tool != ImagingTool::look) return begin_drag(voxel_under(event->pos()));
  events_.look_at(voxel_under(event->pos()));
}

void ImagingPlane::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) end_drag(true);
}

void ImagingPlane::leaveEvent(QEvent* /*event*/) {
  hovered_.reset();
  update();
}

void ImagingPlane::mouseMoveEvent(QMouseEvent* event) {
  if (!scene_.open()) return;
  hovered_ = event->pos();
  if (has_brush()) update();
  if ((event->buttons() & Qt::LeftButton) != 0) {
    return dragging_ ? events_.drag(voxel_under(event->pos())) : events_.look_at(voxel_under(event->pos()));
  }
  if ((event->buttons() & Qt::RightButton) != 0) {
    const QPoint way = event->pos() - dragged_from_;
    dragged_from_ = event->pos();
    return events_.change_window(dragged(scene_.look.window, way.x(), way.y()));
  }
  events_.point_at(voxel_under(event->pos()));
}

void ImagingPlane::mouseDoubleClickEvent(QMouseEvent* event) {
  if (!scene_.open() || event->button() != Qt::LeftButton) return;
  if (scene_.tool != ImagingTool::look) return begin_drag(voxel_under(event->pos()));
  events_.keep(voxel_under(event->pos()));
}

void ImagingPlane::wheelEvent(QWheelEvent* event) {
  turned_ += event->angleDelta().y();  // of a touchpad: a little at a time
  const int notches = turned_ / kWheelStep;
  turned_ %= kWheelStep;
  event->accept();
  if (!scene_.open() || notches == 0) return;
  if ((event->modifiers() & Qt::ControlModifier) == 0) return move_by(0, 0, notches);
  if (has_brush()) events_.change_brush(notches);
}

void ImagingPlane::keyPressEvent(QKeyEvent* event) {
  if (!scene_.open()) return QWidget::keyPressEvent(event);
  switch (event->key()) {
    case Qt::Key_Left:
      return move_by(-1, 0, 0);
    case Qt::Key_Right:
      return move_by(1, 0, 0);
    case Qt::Key_Up:
      return move_by(0, -1, 0);
    case Qt::Key_Down:
      return move_by(0, 1, 0);
    case Qt::Key_PageUp:
      return move_by(0, 0, 1);
    case Qt::Key_PageDown:
      return move_by(0, 0, -1);
    case Qt::Key_Return:
    case Qt::Key_Enter:
      return events_.keep(scene_.crosshair);
    case Qt::Key_Space:
      if (scene_.tool == ImagingTool::look) return QWidget::keyPressEvent(event);
      return dragging_ ? end_drag(true) : begin_drag(scene_.crosshair);
    case Qt::Key_Escape:
      return dragging_ ? end_drag(false) : QWidget::keyPressEvent(event);
    default:
      return QWidget::keyPressEvent(event);
  }
}

void ImagingPlane::focusOutEvent(QFocusEvent* event) {
  end_drag(true);
  QWidget::focusOutEvent(event);
}

void ImagingPlane::move_by(int right, int down, int through) {
  const auto [column, row, slice] = place_in(axes_, scene_.crosshair);
  events_.look_at(voxel_at(axes_, std::clamp(column + right, 0, axes_.columns - 1),
                           std::clamp(row + down, 0, axes_.rows - 1),
                           std::clamp(slice + through, 0, axes_.slices - 1)));
  if (dragging_) events_.drag(scene_.crosshair);
}

void ImagingPlane::go_to_slice(int slice) { move_by(0, 0, slice - this->slice()); }

}  // namespace osteon
