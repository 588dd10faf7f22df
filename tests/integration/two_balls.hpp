// A scan of two balls of bone that touch nothing, and of which everything is known.
#pragma once
#include <cstdint>
#include <numbers>

#include "common/imaging/hu_volume.hpp"

namespace osteon::test {

inline constexpr double kBall_mm = 8.0, kApart_mm = 14.0;  // radius, and distance of a centre from the middle
inline constexpr double kBall_mm3 = 4.0 / 3.0 * std::numbers::pi * kBall_mm * kBall_mm * kBall_mm;
inline constexpr std::int16_t kBall_hu = 1000, kMuscle_hu = 40;

// Balls in muscle, left and right of the middle, on voxels that are not cubes.
[[nodiscard]] imaging::HuVolume two_balls();

}  // namespace osteon::test
