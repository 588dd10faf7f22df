// Seams: where a block meets one that is drawn at a coarser level, the contour of the coarser block is used.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// The number of sample (x, y, z) of a block. Its edge towards +x, +y, +z has the number axis · kBlockSampleCount +
// sample.
inline constexpr int kBlockSampleCount = kBlockSamples * kBlockSamples * kBlockSamples;
inline constexpr std::array<int, 3> kSampleStride{kBlockSamples * kBlockSamples, kBlockSamples, 1};
[[nodiscard]] constexpr int sample_number(int x, int y, int z) {
  return x * kSampleStride[0] + y * kSampleStride[1] + z;
}

// The seam of each sample, edge and face of a block's boundary. The coarsest of the blocks that meet there determines
// the contour.
class SeamRule {
 public:
  explicit SeamRule(const Seams& seams);
  [[nodiscard]] bool any() const { return any_; }
  // Levels between the block and the determining one. A position is inside a half block (1, 3), or on a plane between
  // them (0, 2, 4).
  [[nodiscard]] int steps(int x, int y, int z) const { return steps_[static_cast<std::size_t>((x * 5 + y) * 5 + z)]; }
  static constexpr int of_sample(int i) { return i % 8 != 0 ? 1 + 2 * (i / 8) : i / 4; }
  static constexpr int of_cell(int i) { return 1 + 2 * (i / 8); }  // between samples i and i + 1

 private:
  std::array<std::uint8_t, 125> steps_{};
  bool any_ = false;
};

// Vertices lie on multiples of 1/252 of an edge (4 · 63), so that a position on a coarse edge is also one on a fine
// edge. The ends are excluded, so two vertices never meet at a sample.
inline constexpr int kEdgePlaces = 252;
[[nodiscard]] inline int edge_place(float from, float to) {
  const float t = from / (from - to);
  const int place = static_cast<int>(t * static_cast<float>(kEdgePlaces) + 0.5f);
  return place < 1 ? 1 : place > kEdgePlaces - 1 ? kEdgePlaces - 1 : place;
}

// Gives the samples on seams the values of the coarse contour, in `values` of kBlockApron³ samples. Coarse samples
// stay. On coarse edges the sign changes at the coarse vertex, and on coarse faces along the straight lines between the
// vertices on their edges. The coarsest level is applied first, so that it determines the contour where three levels
// meet.
void take_coarse_contour(const SeamRule& rule, std::span<float> values);

}  // namespace osteon
