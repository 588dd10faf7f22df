// What the tool does, in numbers and as a plot of the last seconds: force that the hand gets and that the bone gives,
// depth, spindle, feed, removed volume. And how much of the hand's force the device can hold.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <deque>
#include <optional>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/cutting_state.hpp"

class QLabel;
class QProgressBar;

namespace osteon {

// A scrolling plot of two quantities over the last seconds.
class ScrollingPlot : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ScrollingPlot)

 public:
  explicit ScrollingPlot(QWidget* parent = nullptr);
  // `at_s`: on any steady clock.
  void add(double at_s, double first, double second);
  [[nodiscard]] QSize sizeHint() const override { return {240, 110}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  struct Sample {
    double at_s, first, second;
  };
  std::deque<Sample> samples_;
};

class GaugesPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(GaugesPanel)

 public:
  explicit GaugesPanel(QWidget* parent = nullptr);

  // `hand`: what the pointer's haptic client reported last. None: another device.
  void show(const CuttingState& state, const std::optional<PointerOutput>& hand, double at_s);
  void show_push(double push_n);

 private:
  void show_budget(double bone_n, const std::optional<PointerOutput>& hand);
  QLabel *bone_, *hand_, *torque_, *depth_, *spindle_, *feed_, *density_, *push_;
  QProgressBar* budget_;  // the force on the hand, of what the device holds for long
  QLabel *budget_words_, *saturated_;
  ScrollingPlot* plot_;
};

}  // namespace osteon
