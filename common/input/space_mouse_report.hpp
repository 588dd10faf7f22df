// SpaceMouse: what its HID reports say. No I/O and no clock.
// Reports as public drivers of these devices have them: 1 translation, with the rotation behind it where it is long
// enough, else 2 rotation; 3 buttons; 0x17 battery.
#pragma once
#include <cstdint>
#include <span>

#include "common/geometry/pose.hpp"

namespace osteon {

inline constexpr std::uint16_t kSpaceMouseRange = 350;  // counts of a cap pushed all the way

struct SpaceMouseState {
  Vec3 push = Vec3::Zero();   // parts of the whole way, −1 … 1, device frame: x right, y up, z to the user
  Vec3 twist = Vec3::Zero();  // the same about these axes, right-handed
  std::uint32_t buttons = 0;
  int battery_percent = -1;  // −1: it has said nothing
};

// Takes a report of any length, id first; false when it is none of these or too short, and then nothing changes.
// The cap's own axes are x right, y to the user, z down [to be checked on a device].
bool take_report(SpaceMouseState& state, std::span<const std::uint8_t> report) noexcept;

// What of a deflection is meant: nothing up to `rest`, from there rising to 1 without a step, in the same direction.
// Two axes pushed together are no more than one.
[[nodiscard]] Vec3 beyond_rest(const Vec3& deflection, double rest) noexcept;

}  // namespace osteon
