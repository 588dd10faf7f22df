// Rate control: the deflection of a cap sets the velocity of a pose. No I/O and no clock.
#pragma once
#include "common/input/space_mouse_report.hpp"

namespace osteon::haptic {

// [A] throughout: what feels right differs between users.
struct RateControlParams {
  double fastest_mm_per_s = 60.0;
  double fastest_rad_per_s = 1.0;
  double rest = 0.05;       // deflection that counts as zero
  double reach_mm = 100.0;  // the pose stays within this distance of its start
};

// Beyond `rest` the velocity rises with the deflection, from zero to the fastest, without a step.
class RateControl {
 public:
  explicit RateControl(const RateControlParams& params = {}) : params_(params) {}
  // Advances the time with the cap in this state. A lasting translation is exact for any step; so is a rotation about
  // one axis.
  void step(const SpaceMouseState& state, double dt_s) noexcept;
  void place(const Pose& pose) noexcept { pose_ = pose; }
  [[nodiscard]] const Pose& pose() const noexcept { return pose_; }

 private:
  RateControlParams params_;
  Pose pose_;
};

}  // namespace osteon::haptic
