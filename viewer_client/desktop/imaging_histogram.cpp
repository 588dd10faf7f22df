#include "viewer_client/desktop/imaging_histogram.hpp"

#include <QMouseEvent>
#include <QPainter>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace osteon {

namespace {

constexpr int kGrasp_px = 8;
constexpr QColor kBars{150, 150, 160}, kThresholdLine{255, 180, 40}, kWindowLine{90, 160, 255};

}  // namespace

ImagingHistogram::ImagingHistogram(Events events, QWidget* parent) : QWidget(parent), events_(std::move(events)) {
  setObjectName("histogram");
  setAccessibleName(tr("Histogram of the HU"));
  setToolTip(tr("Drag the orange threshold, or the blue ends of the window."));
}

void ImagingHistogram::set_histogram(const HuHistogram& histogram) {
  heights_ = heights_of(histogram);
  update();
}

void ImagingHistogram::set_limits(double threshold_hu, const HuWindow& window) {
  threshold_hu_ = threshold_hu;
  window_ = window;
  update();
}

int ImagingHistogram::pixel(double hu) const { return static_cast<int>(std::lround(pixel_of_hu(hu, width()))); }

double ImagingHistogram::hu_of(Limit limit) const {
  if (limit == Limit::threshold) return threshold_hu_;
  return window_.level_hu + (limit == Limit::low ? -0.5 : 0.5) * window_.width_hu;
}

void ImagingHistogram::paintEvent(QPaintEvent* /*event*/) {
  QPainter painter(this);
  painter.fillRect(rect(), Qt::black);
  const double bar_px = static_cast<double>(width()) / kBins;
  for (std::size_t i = 0; i < heights_.size(); ++i) {
    const double high = heights_[i] * height();
    painter.fillRect(QRectF(static_cast<double>(i) * bar_px, height() - high, bar_px, high), kBars);
  }
  const auto line = [&](Limit limit, const QColor& colour) {
    painter.setPen(QPen(colour, 2));
    painter.drawLine(pixel(hu_of(limit)), 0, pixel(hu_of(limit)), height());
  };
  line(Limit::low, kWindowLine);
  line(Limit::high, kWindowLine);
  line(Limit::threshold, kThresholdLine);
}

void ImagingHistogram::mousePressEvent(QMouseEvent* event) {
  dragged_.reset();
  int least = kGrasp_px + 1;
  // Of two limits at one place, the threshold comes first.
  for (const Limit limit : {Limit::threshold, Limit::low, Limit::high})
    if (const int away = std::abs(pixel(hu_of(limit)) - event->pos().x()); away < least) {
      least = away;
      dragged_ = limit;
    }
}

void ImagingHistogram::mouseMoveEvent(QMouseEvent* event) {
  if (dragged_ && (event->buttons() & Qt::LeftButton) != 0) drag_to(event->pos().x());
}

void ImagingHistogram::mouseReleaseEvent(QMouseEvent* /*event*/) { dragged_.reset(); }

void ImagingHistogram::drag_to(int x) {
  const double hu = hu_of_pixel(std::clamp(x, 0, width()), width());
  if (*dragged_ == Limit::threshold) return events_.threshold(static_cast<int>(std::lround(hu)));
  double low = hu_of(Limit::low), high = hu_of(Limit::high);
  if (*dragged_ == Limit::low)
    low = std::min(hu, high - kLeastWidth_hu);
  else
    high = std::max(hu, low + kLeastWidth_hu);
  events_.window({0.5 * (low + high), high - low});
}

}  // namespace osteon
