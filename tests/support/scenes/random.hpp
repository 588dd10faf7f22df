// Random numbers for scenes, equal with every compiler and library.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "common/geometry/pose.hpp"

namespace osteon::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // In [0, 1).
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  // In [0, count).
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  Vec3 in_cube(double half) {
    const double x = between(-half, half), y = between(-half, half), z = between(-half, half);
    return {x, y, z};
  }
  // Uniform over the sphere of directions.
  Vec3 direction() {
    const double z = between(-1.0, 1.0), angle = between(0.0, 2.0 * std::numbers::pi);
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace osteon::test
