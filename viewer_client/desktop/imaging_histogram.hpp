// The histogram of a scan's HU, with the threshold of bone and the limits of the window to drag.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>
#include <optional>
#include <vector>

#include "viewer_client/imaging/hu_histogram.hpp"
#include "viewer_client/imaging/hu_window.hpp"

namespace osteon {

// [GUI thread] What the limits set can be set by keys too, in the fields beside it.
class ImagingHistogram : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingHistogram)

 public:
  struct Events {
    std::function<void(int hu)> threshold;
    std::function<void(const HuWindow& window)> window;
  };
  explicit ImagingHistogram(Events events, QWidget* parent = nullptr);

  void set_histogram(const HuHistogram& histogram);
  void set_limits(double threshold_hu, const HuWindow& window);
  [[nodiscard]] int pixel(double hu) const;
  [[nodiscard]] QSize sizeHint() const override { return {250, 90}; }
  [[nodiscard]] QSize minimumSizeHint() const override { return {120, 60}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;

 private:
  enum class Limit { threshold, low, high };
  [[nodiscard]] double hu_of(Limit limit) const;
  void drag_to(int x);

  Events events_;
  std::vector<double> heights_;
  double threshold_hu_ = 0.0;
  HuWindow window_;
  std::optional<Limit> dragged_;
};

}  // namespace osteon
