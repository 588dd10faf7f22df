// How fast a force on the hand may grow that the hand does not cause. Lessening what there is comes at once: growth is
// the way from the nearest part of it.
#pragma once
#include <algorithm>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// What of `wanted` is growth from `now`; any unit, both in one frame.
[[nodiscard]] inline Vec3 growth(const Vec3& wanted, const Vec3& now) noexcept {
  const double square = now.squaredNorm();
  return wanted - (square > 0.0 ? std::clamp(wanted.dot(now) / square, 0.0, 1.0) : 0.0) * now;
}

// Forces that each grow slowly may add up to one that does not, where one lessens at once that held another back: a
// hand is led against bone, and the bone gives way. What `part_n` is to be so that the whole, `rest_n` besides it,
// grows by no more than that from `before_n`; the whole is never larger by it than it would be, or was.
[[nodiscard]] inline Vec3 held_to(double most_n, const Vec3& part_n, const Vec3& rest_n,
                                  const Vec3& before_n) noexcept {
  const Vec3 grown_n = growth(rest_n + part_n, before_n);
  const double size_n = grown_n.norm();
  return size_n > most_n ? Vec3(part_n - (1.0 - most_n / size_n) * grown_n) : part_n;
}

}  // namespace osteon::haptic
