// The voxel lattice. Sample (i, j, k) of level l lies at exactly (i, j, k) · h / 2^l millimetres in the bone's frame.
// Coordinates come from global integers, so every program computes the same position.
#pragma once
#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "common/geometry/pose.hpp"

namespace osteon {

inline constexpr int kLevels = 3;    // pitches h, h/2, h/4
inline constexpr int kLeafSize = 8;  // voxels along a leaf's edge
inline constexpr int kLeafVoxels = kLeafSize * kLeafSize * kLeafSize;

struct Coord {
  std::int32_t x = 0, y = 0, z = 0;
  friend auto operator<=>(const Coord&, const Coord&) = default;
  friend Coord operator+(Coord a, Coord b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Coord operator-(Coord a, Coord b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Coord operator*(std::int32_t k, Coord c) { return {k * c.x, k * c.y, k * c.z}; }
};

// Rounds towards minus infinity to a multiple of a power of two.
[[nodiscard]] constexpr Coord floor_to(Coord c, std::int32_t power_of_two) {
  const std::int32_t mask = ~(power_of_two - 1);
  return {c.x & mask, c.y & mask, c.z & mask};
}
// Division by 2^shift, rounding towards minus infinity.
[[nodiscard]] constexpr Coord shift_down(Coord c, int shift) { return {c.x >> shift, c.y >> shift, c.z >> shift}; }

// A coordinate, or a product of some, as the index into an array. It must not be negative.
[[nodiscard]] constexpr std::size_t to_index(std::int32_t i) { return static_cast<std::size_t>(i); }

struct CoordHash {
  std::size_t operator()(const Coord& c) const noexcept {
    return static_cast<std::uint32_t>(c.x) * 73856093u ^ static_cast<std::uint32_t>(c.y) * 19349663u ^
           static_cast<std::uint32_t>(c.z) * 83492791u;
  }
};

// A box of samples, both ends included; empty when max < min on any axis.
struct CoordBox {
  Coord min{0, 0, 0};
  Coord max{-1, -1, -1};
  [[nodiscard]] bool empty() const { return max.x < min.x || max.y < min.y || max.z < min.z; }
  [[nodiscard]] Coord dims() const { return {max.x - min.x + 1, max.y - min.y + 1, max.z - min.z + 1}; }
  [[nodiscard]] CoordBox grown(std::int32_t by) const {
    return {{min.x - by, min.y - by, min.z - by}, {max.x + by, max.y + by, max.z + by}};
  }
  [[nodiscard]] bool contains(Coord c) const {
    return c.x >= min.x && c.y >= min.y && c.z >= min.z && c.x <= max.x && c.y <= max.y && c.z <= max.z;
  }
  friend bool operator==(const CoordBox&, const CoordBox&) = default;
};

// An axis-aligned box in millimetres; empty when max < min on any axis.
struct Box {
  Vec3 min_mm = Vec3::Constant(1.0);
  Vec3 max_mm = Vec3::Constant(-1.0);
  [[nodiscard]] bool empty() const { return (max_mm.array() < min_mm.array()).any(); }
  [[nodiscard]] Vec3 centre_mm() const { return 0.5 * (min_mm + max_mm); }
  [[nodiscard]] Vec3 size_mm() const { return max_mm - min_mm; }
  void include(const Vec3& p) {
    if (empty()) {
      min_mm = max_mm = p;
    } else {
      min_mm = min_mm.cwiseMin(p);
      max_mm = max_mm.cwiseMax(p);
    }
  }
  [[nodiscard]] Box grown(double by_mm) const { return {min_mm.array() - by_mm, max_mm.array() + by_mm}; }
};

// Pitch of a level, mm. Levels below 0 are coarser and are used to draw distant surfaces. Halving is exact in binary,
// so the number is the same everywhere.
[[nodiscard]] constexpr double level_pitch_mm(double pitch_mm, int level) {
  return level < 0 ? pitch_mm * static_cast<double>(1 << -level) : pitch_mm / static_cast<double>(1 << level);
}

// No cut is stored finer than this, unless the case itself is finer.
inline constexpr double kFinestCut_mm = 0.1;
// The finest level of cuts in a case with pitch h. It is 0 if h / 2 is already below kFinestCut_mm.
[[nodiscard]] constexpr int finest_level(double pitch_mm) {
  int level = 0;
  // A margin of 0.1 percent, so that h = 0.4 mm has its level of 0.1 mm despite rounding.
  while (level + 1 < kLevels && level_pitch_mm(pitch_mm, level + 1) >= 0.999 * kFinestCut_mm) ++level;
  return level;
}

[[nodiscard]] inline Vec3 position_mm(Coord c, double level_pitch) {
  return {c.x * level_pitch, c.y * level_pitch, c.z * level_pitch};
}

// The smallest box of lattice samples that encloses `box`.
[[nodiscard]] CoordBox covering_samples(const Box& box, double level_pitch);

}  // namespace osteon
