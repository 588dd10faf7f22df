// The gauges of the tool: push, force of the bone and on the hand, torque, depth, spindle, feed, density, flutes and
// wear; and how far the tool is from what is planned for it. The gauge of the temperature says that it is not
// simulated. A plot shows both forces over the last ten seconds, and a bar how much of what the device holds the hand
// gets.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <deque>
#include <optional>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/plan_offset.hpp"

class QLabel;
class QProgressBar;

namespace osteon {

// A scrolling plot of two quantities over the last seconds.
class ScrollingPlot : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ScrollingPlot)

 public:
  explicit ScrollingPlot(QWidget* parent = nullptr);
  // `at_s`: on any steady clock. While both lines are level, the plot is not drawn again.
  void add(double at_s, double first, double second);
  [[nodiscard]] QSize sizeHint() const override { return {240, 110}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  struct Sample {
    double at_s, first, second;
  };
  std::deque<Sample> samples_;
  double level_first_ = 0, level_second_ = 0, level_since_s_ = 0;  // both have stayed near these values since then
};

// What a device shows of the bone's force.
struct HandForce {
  double bone_n = 0, hand_n = 0;  // what the bone gives, what the hand gets
  double device_holds_n = 0;      // the most that the device holds for long; 0: not known
  double depth_mm = 0;            // of the tip along its axis
  bool saturated = false;         // the device cannot hold what it should show
};

// `output`: the newest report of the window's own pointer. None: another device holds the tool, and `state` tells of
// it. Returns none if that device's limit is not known.
[[nodiscard]] std::optional<HandForce> hand_force(const CuttingState& state,
                                                  const std::optional<PointerOutput>& output);

class GaugesPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(GaugesPanel)

 public:
  explicit GaugesPanel(QWidget* parent = nullptr);

  // `pointer`: the newest report of the window's own pointer. None: another device holds the tool.
  void show(const CuttingState& state, const std::optional<PointerOutput>& pointer, double at_s);
  void show_push(double push_n);
  // None: nothing is planned for this tool. `name`: of the axis or plane.
  void show_plan(const std::optional<PlanOffset>& offset, const QString& name);

 private:
  void show_budget(const std::optional<HandForce>& hand);
  QLabel *bone_, *hand_, *torque_, *depth_, *spindle_, *feed_, *density_, *flutes_, *wear_, *push_;
  QLabel *plan_angle_, *plan_beside_, *plan_depth_;
  QProgressBar* budget_;  // force on the hand as a share of what the device holds for long
  QLabel *budget_words_, *saturated_;
  ScrollingPlot* plot_;
};

}  // namespace osteon
