// Seams: where a block meets one that is drawn at a coarser level, the coarser one's contour rules.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// Sample (x, y, z) of a block has this number; its edge towards +x, +y, +z the number axis · kBlockSampleCount +
// sample.
inline constexpr int kBlockSampleCount = kBlockSamples * kBlockSamples * kBlockSamples;
inline constexpr std::array<int, 3> kSampleStride{kBlockSamples * kBlockSamples, kBlockSamples, 1};
[[nodiscard]] constexpr int sample_number(int x, int y, int z) {
  return x * kSampleStride[0] + y * kSampleStride[1] + z;
}

// Which seam each sample, edge and face of a block's boundary lies on: the coarsest of the blocks that meet there
// rules.
class SeamRule {
 public:
  explicit SeamRule(const Seams& seams);
  [[nodiscard]] bool any() const { return any_; }
  // Levels between the block and the ruling one. A place is inside a half block (1, 3), or on a plane between (0, 2,
  // 4).
  [[nodiscard]] int steps(int x, int y, int z) const { return steps_[static_cast<std::size_t>((x * 5 + y) * 5 + z)]; }
  static constexpr int of_sample(int i) { return i % 8 != 0 ? 1 + 2 * (i / 8) : i / 4; }
  static constexpr int of_cell(int i) { return 1 + 2 * (i / 8); }  // between samples i and i + 1

 private:
  std::array<std::uint8_t, 125> steps_{};
  bool any_ = false;
};

// Vertices lie on whole 252ths of an edge, 4 · 63, so that a place on a coarse edge is a whole place on a fine one. The
// ends are left out: two vertices never meet at a sample.
inline constexpr int kEdgePlaces = 252;
[[nodiscard]] inline int edge_place(float from, float to) {
  const float t = from / (from - to);
  const int place = static_cast<int>(t * static_cast<float>(kEdgePlaces) + 0.5f);
  return place < 1 ? 1 : place > kEdgePlaces - 1 ? kEdgePlaces - 1 : place;
}

// Gives the samples on seams the values of the ruling contour, in `values` of kBlockApron³ samples: those of the coarse
// samples stay, on coarse edges they change sign where the coarse vertex is, and on coarse faces along the straight
// lines between the vertices on their edges. Coarsest first, so that where three levels meet the coarsest rules.
void take_coarse_contour(const SeamRule& rule, std::span<float> values);

}  // namespace osteon
