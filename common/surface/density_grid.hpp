// The density of a bone as viewers have it: rounded to steps, and only in leaves that contain bone.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>

#include "common/geometry/lattice.hpp"

namespace osteon {

inline constexpr double kDensityStep_g_cm3 = 0.01;  // of a sample; a density above 2.55 g/cm³ becomes 2.55
inline constexpr std::size_t kDensitySamples = 512;
inline constexpr std::size_t kMostDensityLeaves = 20000;  // 10 MB

using DensityLeaf = std::array<std::uint8_t, kDensitySamples>;  // 8³ samples, z fastest

class DensityGrid {
 public:
  DensityGrid() = default;
  explicit DensityGrid(double pitch_mm) : pitch_mm_(pitch_mm) {}

  // `leaf`: its first sample divided by 8. Sample (i, j, k) lies at (i, j, k) · pitch in the bone's frame.
  void add(Coord leaf, const DensityLeaf& samples) { leaves_[leaf] = samples; }

  [[nodiscard]] double pitch_mm() const { return pitch_mm_; }
  [[nodiscard]] const std::unordered_map<Coord, DensityLeaf, CoordHash>& leaves() const { return leaves_; }
  // Density at a point of the bone's frame: trilinear; 0 where there is no bone. Any thread.
  [[nodiscard]] double g_cm3(const Vec3& point_mm) const;

 private:
  double pitch_mm_ = 1.0;
  std::unordered_map<Coord, DensityLeaf, CoordHash> leaves_;
};

}  // namespace osteon
