// Gathers the samples of one mesh block: 19³ samples from the 4³ leaves that they meet, by loops of constant length.
#pragma once
#include <cstddef>
#include <span>

#include "common/geometry/lattice.hpp"

namespace osteon {

// Two leaves, one sample before them and two after.
inline constexpr std::int32_t kBlockSide = 2 * kLeafSize + 3;
inline constexpr std::size_t kBlockVolume = static_cast<std::size_t>(kBlockSide) * kBlockSide * kBlockSide;
inline constexpr std::size_t kBlockLeaves = 4 * 4 * 4;
[[nodiscard]] inline bool is_block(const CoordBox& box) {
  const std::int32_t side = kBlockSide - 1, last = kLeafSize - 1;
  return box.max - box.min == Coord{side, side, side} && (box.min.x & last) == last && (box.min.y & last) == last &&
         (box.min.z & last) == last;
}

// A leaf for reading: its samples, or null and the value of all samples.
struct LeafView {
  const float* samples;
  float constant;
};

// Copies from the leaves that meet the block, x slowest.
void copy_block(std::span<const LeafView, kBlockLeaves> leaves, std::span<float, kBlockVolume> out);
// to = max(from, −R), but `from` where R is at its clip `uncut`. `to` may be the same as `from`.
void cut_block(std::span<const LeafView, kBlockLeaves> leaves, float uncut, std::span<const float, kBlockVolume> from,
               std::span<float, kBlockVolume> to);
// Trilinear interpolation from a lattice 2 or 4 times (shift 1, 2) as coarse, one axis after the other: z, y, x.
// `coarse` begins at the sample at or before the first of the block, and has coarse_side() samples along each axis.
[[nodiscard]] constexpr std::int32_t coarse_side(int shift) {
  return ((kBlockSide - 1 + (1 << shift) - 1) >> shift) + 2;
}
void interpolate_block(std::span<const float> coarse, int shift, std::span<float, kBlockVolume> out);

}  // namespace osteon
