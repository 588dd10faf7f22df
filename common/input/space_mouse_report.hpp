// Decodes the HID reports of a SpaceMouse. No I/O and no clock. Reports as in public drivers of these devices: 1
// translation, followed by the rotation if it is long enough, otherwise 2 rotation; 3 buttons; 0x17 battery.
#pragma once
#include <cstdint>
#include <span>

#include "common/geometry/pose.hpp"

namespace osteon {

inline constexpr std::uint16_t kSpaceMouseRange = 350;  // counts of a cap at full deflection

struct SpaceMouseState {
  Vec3 push = Vec3::Zero();   // fractions of full deflection, −1 … 1, device frame: x right, y up, z to the user
  Vec3 twist = Vec3::Zero();  // the same about these axes, right-handed
  std::uint32_t buttons = 0;
  int battery_percent = -1;  // −1: not reported yet
};

// Processes a report of any length, id first. False if it is none of these or too short; then nothing changes. The
// cap's own axes are x right, y to the user, z down [to be checked on a device].
bool take_report(SpaceMouseState& state, std::span<const std::uint8_t> report) noexcept;

// Removes the dead zone of a deflection: zero up to `rest`, from there rising to 1 without a step, in the same
// direction. Two axes pushed together give at most 1.
[[nodiscard]] Vec3 beyond_rest(const Vec3& deflection, double rest) noexcept;

}  // namespace osteon
