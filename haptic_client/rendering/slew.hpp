// Limits how fast a force on the hand grows when the hand does not cause the growth. A decrease takes effect at once.
// Growth is the vector from the nearest force between zero and the present force.
#pragma once
#include <algorithm>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// The part of `wanted` that is growth from `now`; any unit, both in one frame.
[[nodiscard]] inline Vec3 growth(const Vec3& wanted, const Vec3& now) noexcept {
  const double square = now.squaredNorm();
  return wanted - (square > 0.0 ? std::clamp(wanted.dot(now) / square, 0.0, 1.0) : 0.0) * now;
}

// Two forces that grow slowly may have a sum that grows fast. This happens when one held the other back and decreases
// at once. Example: a hand is led against bone, and the bone gives way. Returns the value of `part_n` with which the
// whole, including `rest_n`, grows by at most `most_n` from `before_n`. The whole never exceeds the larger of
// `before_n` and the unlimited whole.
[[nodiscard]] inline Vec3 held_to(double most_n, const Vec3& part_n, const Vec3& rest_n,
                                  const Vec3& before_n) noexcept {
  const Vec3 grown_n = growth(rest_n + part_n, before_n);
  const double size_n = grown_n.norm();
  return size_n > most_n ? Vec3(part_n - (1.0 - most_n / size_n) * grown_n) : part_n;
}

}  // namespace osteon::haptic
