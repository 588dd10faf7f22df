// SpaceMouse: what its HID reports say, and how a deflected cap becomes a moving pose. No I/O and no clock.
// Reports as public drivers of these devices have them: 1 translation, with the rotation behind it where it is long enough,
// else 2 rotation; 3 buttons; 0x17 battery.
#pragma once
#include <cstdint>
#include <span>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

inline constexpr std::uint16_t kSpaceMouseRange = 350;  // counts of a cap pushed all the way

struct SpaceMouseState {
  Vec3 push = Vec3::Zero();   // parts of the whole way, −1 … 1, device frame: x right, y up, z to the user
  Vec3 twist = Vec3::Zero();  // the same about these axes, right-handed
  std::uint32_t buttons = 0;
  int battery_percent = -1;   // −1: it has said nothing
};

// Takes a report of any length, id first; false when it is none of these or too short, and then nothing changes.
// The cap's own axes are x right, y to the user, z down [to be checked on a device].
bool take_report(SpaceMouseState& state, std::span<const std::uint8_t> report) noexcept;

// [A] throughout: what feels right differs from hand to hand.
struct RateControlParams {
  double fastest_mm_per_s = 60.0;
  double fastest_rad_per_s = 1.0;
  double rest = 0.05;       // deflection that counts as none
  double reach_mm = 100.0;  // the pose stays within this distance of its start
};

// Rate control: the cap's deflection is the velocity of a pose. Beyond `rest` the velocity rises with the deflection from
// zero to the fastest, so that it has no step.
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
