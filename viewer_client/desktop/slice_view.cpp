#include "viewer_client/desktop/slice_view.hpp"

#include <QKeyEvent>
#include <QLocale>
#include <QMouseEvent>
#include <QPainter>
#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer_client/desktop/edge_letters.hpp"

namespace osteon {

namespace {

constexpr double kNotchOfWheel = 120.0, kZoomOfNotch = 0.85;
constexpr double kCrossGap_px = 6.0;  // of the cross round its middle, so that the tip is seen
constexpr QRgb kToolColour = 0xfff0e442, kPlannedColour = 0xff56b4e9;
constexpr double kEnd_px = 7.0, kEndDepth_mm = 2.0;  // how near the pointer and the slice are to an end that is taken
constexpr double kNearlyAlong = 1e-6;

// The middle of the pixel of the screen under the pointer.
QPointF place_under(const QMouseEvent& event) { return event.localPos() + QPointF(0.5, 0.5); }

}  // namespace

SliceView::SliceView(Events events, QWidget* parent) : QWidget(parent), events_(std::move(events)) {
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setCursor(Qt::CrossCursor);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Expanding);
  setContextMenuPolicy(Qt::PreventContextMenu);  // the right button sets the window
  setAttribute(Qt::WA_OpaquePaintEvent);
}

void SliceView::set_title(const QString& title, const QColor& colour, const std::array<QColor, 2>& line_colours) {
  title_ = title;
  colour_ = colour;
  line_colours_ = line_colours;
  setAccessibleName(title);
  update();
}

void SliceView::show_image(std::shared_ptr<const SliceImage> image, const HuWindow& window) {
  if (image == image_ && window == window_) return;
  image_ = std::move(image);
  window_ = window;
  if (!image_) {
    grey_ = {};
  } else {
    const radiology::PixelGrid& plane = image_->plane;
    if (grey_.width() != plane.columns || grey_.height() != plane.rows)
      grey_ = QImage(plane.columns, plane.rows, QImage::Format_Grayscale8);
    const auto columns = static_cast<std::size_t>(plane.columns);
    for (int row = 0; row < plane.rows; ++row)  // each line of the picture begins at a multiple of four bytes
      grey_of(std::span(image_->hu).subspan(plane.index(0, row), columns), window_, {grey_.scanLine(row), columns});
  }
  refresh_overlay();
}

void SliceView::show_overlay(const SliceOverlay& overlay) {
  overlay_ = overlay;
  refresh_overlay();
}

void SliceView::refresh_overlay() {
  outline_.clear();
  if (image_ && overlay_.tool) outline_ = outline_in(image_->plane, *overlay_.tool);
  update();
}

void SliceView::set_notice(const QString& notice) {
  if (notice == notice_) return;
  notice_ = notice;
  update();
}

ImageSize SliceView::size_px() const {
  const double ratio = devicePixelRatioF();
  return {std::max(1, static_cast<int>(std::lround(width() * ratio))),
          std::max(1, static_cast<int>(std::lround(height() * ratio)))};
}

QPointF SliceView::to_widget(const Pixel& pixel) const {
  const double ratio = devicePixelRatioF();
  return {0.5 * width() + (pixel.x() - 0.5 * (image_->plane.columns - 1)) / ratio,
          0.5 * height() + (pixel.y() - 0.5 * (image_->plane.rows - 1)) / ratio};
}

Pixel SliceView::to_image(const QPointF& place) const {
  const double ratio = devicePixelRatioF();
  return {(place.x() - 0.5 * width()) * ratio + 0.5 * (image_->plane.columns - 1),
          (place.y() - 0.5 * height()) * ratio + 0.5 * (image_->plane.rows - 1)};
}

QPointF SliceView::place_of(const Vec3& point_mm) const {
  return image_ ? to_widget(pixel_at(image_->plane, point_mm)) : QPointF();
}

Vec3 SliceView::point_at(const QPointF& place) const {
  if (!image_) return Vec3::Zero();
  const Pixel pixel = to_image(place);
  return image_->plane.at(pixel.x(), pixel.y());
}

std::optional<double> SliceView::hu_at(const Vec3& point_mm) const {
  if (!image_) return {};
  const Pixel at = pixel_at(image_->plane, point_mm);
  const double column = std::round(at.x()), row = std::round(at.y());
  if (!(column >= 0.0 && row >= 0.0 && column < image_->plane.columns && row < image_->plane.rows)) return {};
  return static_cast<double>(image_->hu[image_->plane.index(static_cast<int>(column), static_cast<int>(row))]);
}

void SliceView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), Qt::black);
  if (!image_) {
    painter.setPen(Qt::white);
    painter.drawText(rect().adjusted(kWordsEdge_px, kWordsEdge_px, -kWordsEdge_px, -kWordsEdge_px),
                     Qt::AlignCenter | Qt::TextWordWrap, notice_);
  } else {
    const double ratio = devicePixelRatioF();
    const QPointF corner = to_widget(Pixel(-0.5, -0.5));
    painter.drawImage(QRectF(corner, QSizeF(grey_.width() / ratio, grey_.height() / ratio)), grey_);
    painter.setRenderHint(QPainter::Antialiasing);
    paint_lines(painter);
    paint_planned(painter);
    paint_drawn(painter);
    painter.setPen(QPen(QColor(kToolColour), 1.5));
    for (const OutlinePart& part : outline_) painter.drawLine(to_widget(part.from), to_widget(part.to));
    paint_words(painter);
  }
  painter.setRenderHint(QPainter::Antialiasing, false);
  painter.setPen(QPen(colour_, hasFocus() ? 3 : 1));
  painter.drawRect(rect().adjusted(0, 0, -1, -1));
}

void SliceView::paint_lines(QPainter& painter) const {
  const QPointF cross = place_of(overlay_.point_mm);
  painter.setPen(line_colours_[0]);
  painter.drawLine(QPointF(0, cross.y()), QPointF(cross.x() - kCrossGap_px, cross.y()));
  painter.drawLine(QPointF(cross.x() + kCrossGap_px, cross.y()), QPointF(width(), cross.y()));
  painter.setPen(line_colours_[1]);
  painter.drawLine(QPointF(cross.x(), 0), QPointF(cross.x(), cross.y() - kCrossGap_px));
  painter.drawLine(QPointF(cross.x(), cross.y() + kCrossGap_px), QPointF(cross.x(), height()));
  if (!overlay_.tool_axis) return;
  if (const auto axis = project(image_->plane, overlay_.tool_axis->point_mm, overlay_.tool_axis->direction)) {
    painter.setPen(QPen(QColor(kToolColour), 1.0, Qt::DotLine));
    painter.drawLine(to_widget(axis->from), to_widget(axis->to));
  }
}

void SliceView::paint_planned(QPainter& painter) const {
  for (const SliceOverlay::Planned& planned : overlay_.planned) {
    const auto line = project(image_->plane, planned.point_mm, planned.direction);
    if (!line) continue;
    painter.setPen(QPen(QColor(kPlannedColour), 1.5, Qt::DashLine));
    painter.drawLine(to_widget(line->from), to_widget(line->to));
    if (!line->through) continue;
    constexpr double kThroughRing_px = 4.0;
    painter.setPen(QPen(QColor(kPlannedColour), 1.5));
    const QPointF through = to_widget(*line->through);
    painter.drawEllipse(through, kThroughRing_px, kThroughRing_px);
    write_outlined(painter, QRect(through.toPoint() + QPoint(6, -18), QSize(width(), 16)),
                   Qt::AlignLeft | Qt::AlignVCenter, planned.name, QColor(kPlannedColour));
  }
}

// An axis is a line with a bar across its target. A plane is the line in which it meets the slice. Ends that the mouse
// can take are squares.
void SliceView::paint_drawn(QPainter& painter) const {
  const radiology::PixelGrid& plane = image_->plane;
  const Vec3 normal = normal_of(plane);
  for (const Annotation& one : overlay_.drawn) {
    const std::vector<Vec3> points = points_mm(one);
    const QColor colour(0xff000000 | one.colour);
    const QPointF first = place_of(points[0]), second = place_of(points[1]);
    painter.setPen(QPen(colour, one.id == overlay_.selected ? 2.5 : 1.5));
    if (one.kind == AnnotationKind::axis) {
      constexpr double kHalfBar_px = 6.0;
      const QLineF line(first, second);
      painter.drawLine(line);
      QLineF bar = line.normalVector().unitVector();
      bar.setLength(kHalfBar_px);
      const QPointF half = bar.p2() - bar.p1();
      if (line.length() > 1.0) painter.drawLine(second - half, second + half);
    } else if (const Vec3 through = planned_direction(one), trace = normal.cross(through);
               trace.norm() > kNearlyAlong) {
      const Vec3 to_slice = trace.cross(through);  // within the plane
      const Vec3 at = points[0] - depth_mm(plane, points[0]) / normal.dot(to_slice) * to_slice;
      if (const auto line = project(plane, at, trace.normalized()))
        painter.drawLine(to_widget(line->from), to_widget(line->to));
    }
    for (const std::size_t end : {std::size_t{0}, std::size_t{1}})
      if (std::abs(depth_mm(plane, points[end])) <= kEndDepth_mm)
        painter.fillRect(QRectF(place_of(points[end]) - QPointF(3.5, 3.5), QSizeF(7, 7)), colour);
    // The words of an axis that comes from the right are on its left, so that they do not cover it, if there is room.
    const QString words = QString::fromStdString(one.words);
    const QSize size(width(), 16);
    const bool has_room = second.x() - 8 >= painter.fontMetrics().horizontalAdvance(words);
    const bool on_left = one.kind == AnnotationKind::axis && first.x() > second.x() && has_room;
    write_outlined(painter, QRect(second.toPoint() + QPoint(on_left ? -8 - size.width() : 8, -18), size),
                   (on_left ? Qt::AlignRight : Qt::AlignLeft) | Qt::AlignVCenter, words, colour);
  }
  if (!overlay_.begun) return;
  painter.setPen(QPen(QColor(kPlannedColour), 2.0));
  painter.drawEllipse(place_of(*overlay_.begun), kEnd_px, kEnd_px);
}

void SliceView::paint_words(QPainter& painter) const {
  const radiology::PixelGrid& plane = image_->plane;
  const QRect inner = rect().adjusted(kWordsEdge_px, kWordsEdge_px, -kWordsEdge_px, -kWordsEdge_px);
  write_outlined(painter, inner, Qt::AlignTop | Qt::AlignLeft, title_, colour_);
  paint_edge_letters(painter, rect(), edge_letters(plane.column_mm, plane.row_mm));
  const double mm_per_px = plane.column_mm.norm() * devicePixelRatioF();
  const double bar_mm = scale_bar_mm(width() * mm_per_px / 4.0), bar_px = bar_mm / mm_per_px;
  const QPointF end(inner.right(), inner.bottom() - 1), begin = end - QPointF(bar_px, 0);
  painter.setPen(QPen(Qt::white, 2));
  painter.drawLine(begin, end);
  const int decimals = bar_mm < 1.0 ? 1 : 0;
  write_outlined(painter, inner.adjusted(0, 0, 0, -kWordsEdge_px), Qt::AlignBottom | Qt::AlignRight,
                 tr("%1 mm").arg(QLocale().toString(bar_mm, 'f', decimals)));
}

void SliceView::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  events_.resized();
}

std::optional<SliceView::End> SliceView::end_under(const QPointF& place) const {
  std::optional<End> nearest;
  double nearest_px = kEnd_px;
  for (const Annotation& one : overlay_.drawn)
    for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {
      const Vec3 at = from_steps(one.points[end]);
      const double depth = depth_mm(image_->plane, at), away_px = QLineF(place, place_of(at)).length();
      if (std::abs(depth) > kEndDepth_mm || away_px > nearest_px) continue;
      nearest = End{one.id, end, depth};
      nearest_px = away_px;
    }
  return nearest;
}

// An end keeps its depth: it moves along the image.
void SliceView::use_left_button(const QPointF& place) {
  if (drew_) return;
  if (held_)
    events_.dragged(held_->id, held_->end, point_at(place) + held_->depth_mm * normal_of(image_->plane));
  else
    events_.point(point_at(place));
}

void SliceView::mousePressEvent(QMouseEvent* event) {
  last_ = pressed_ = event->pos();
  if (!image_ || event->button() != Qt::LeftButton) return;
  const QPointF place = place_under(*event);
  drew_ = overlay_.draws;
  if (drew_) return events_.drawn(point_at(place));
  held_ = end_under(place);
  if (!held_) events_.point(point_at(place));
}

void SliceView::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return;
  drew_ = false;
  if (!std::exchange(held_, std::nullopt)) return;
  events_.dropped();
  // A click that drags nothing is for the cross.
  if (image_ && event->pos() == pressed_) events_.point(point_at(place_under(*event)));
}

void SliceView::mouseMoveEvent(QMouseEvent* event) {
  const QPoint by = event->pos() - last_;
  last_ = event->pos();
  if (!image_) return;
  if (event->buttons() & Qt::LeftButton)
    use_left_button(place_under(*event));
  else if (event->buttons() & Qt::RightButton)
    events_.window(by.x(), by.y());
  else if (event->buttons() & Qt::MiddleButton)
    events_.shift(point_at(QPointF(0, 0)) - point_at(by));
  events_.hovered(point_at(place_under(*event)));
}

void SliceView::wheelEvent(QWheelEvent* event) {
  const double notches = event->angleDelta().y() / kNotchOfWheel;
  if (event->modifiers() & Qt::ControlModifier)
    events_.zoom(std::pow(kZoomOfNotch, notches));
  else
    events_.move(notches);
  event->accept();
}

// What the mouse does, by keys.
void SliceView::keyPressEvent(QKeyEvent* event) {
  constexpr double kStep_px = 2.0;
  const auto step = [&](double right, double down) {
    if (image_) events_.point(point_at(place_of(overlay_.point_mm) + QPointF(right, down)));
  };
  switch (event->key()) {
    case Qt::Key_Left:
      return step(-kStep_px, 0);
    case Qt::Key_Right:
      return step(kStep_px, 0);
    case Qt::Key_Up:
      return step(0, -kStep_px);
    case Qt::Key_Down:
      return step(0, kStep_px);
    case Qt::Key_PageUp:
      return events_.move(1.0);
    case Qt::Key_PageDown:
      return events_.move(-1.0);
    case Qt::Key_Plus:
      return events_.zoom(kZoomOfNotch);
    case Qt::Key_Minus:
      return events_.zoom(1.0 / kZoomOfNotch);
    default:
      event->ignore();
  }
}

void SliceView::leaveEvent(QEvent* event) {
  QWidget::leaveEvent(event);
  events_.hovered(std::nullopt);
}

}  // namespace osteon
