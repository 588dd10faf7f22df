// Rate control: a deflected cap is the velocity of a pose. No I/O and no clock.
#pragma once
#include "common/input/space_mouse_report.hpp"

namespace osteon::haptic {

// [A] throughout: what feels right differs from hand to hand.
struct RateControlParams {
  double fastest_mm_per_s = 60.0;
  double fastest_rad_per_s = 1.0;
  double rest = 0.05;       // deflection that counts as none
  double reach_mm = 100.0;  // the pose stays within this distance of its start
};

// Beyond `rest` the velocity rises with the deflection from zero to the fastest, so that it has no step.
class RateControl {
 public:
  explicit RateControl(const RateControlParams& params = {}) : params_(params) {}
  // Time passes with the cap held so. A translation that lasts is exact for any step; so is a rotation about one axis.
  void step(const SpaceMouseState& state, double dt_s) noexcept;
  void place(const Pose& pose) noexcept { pose_ = pose; }
  [[nodiscard]] const Pose& pose() const noexcept { return pose_; }

 private:
  RateControlParams params_;
  Pose pose_;
};

}  // namespace osteon::haptic
