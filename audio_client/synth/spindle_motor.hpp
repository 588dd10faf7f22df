// The speed of a tool's spindle between the states that arrive: its motor goes on, under the newest torque.
#pragma once
#include "common/mechanics/spindle.hpp"

namespace osteon::audio {

// A state says how fast the spindle turned under the load that it had. The command, which nobody sends, is that speed
// and what the model's motor has lost to the load. So a torque acts at once, with the motor's inertia; where model and
// state agree, the next state changes nothing. A tool that stands under a torque has stalled, and its command stays.
class SpindleMotor {
 public:
  void start(const SpindleParams& params, double run_down_s) noexcept;
  void aim(double rpm, double torque_Nmm) noexcept;  // a state
  void step(double dt_s) noexcept;

  [[nodiscard]] double rpm() const noexcept { return spindle_.rpm; }
  [[nodiscard]] bool stalled() const noexcept { return spindle_.stalled; }

 private:
  SpindleParams params_;
  double run_down_s_ = 0.45;
  Spindle spindle_;
  double command_rpm_ = 0, torque_Nmm_ = 0;
  double span_rpm_ = 0;  // rated speed, or a higher one of this run: determines how fast it runs up and down
};

}  // namespace osteon::audio
