#include "common/volume/block_gather.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "common/core/check.hpp"

namespace osteon {
namespace {

constexpr std::size_t kSide = kBlockSide;

// Loops of constant length, so that a compiler turns each into a few vector instructions.
template <std::size_t kCount, class Each>
inline void times(Each each) {
  for (std::size_t i = 0; i < kCount; ++i) each(i);
}

float cut(float s, float r, float uncut) {
  const float other = r < uncut ? -r : s;
  return s < other ? other : s;
}

// The same for several samples at once. Written out, because a compiler does not know that rows of samples are separate
// or identical.
using Four = float __attribute__((vector_size(16)));
using Two = float __attribute__((vector_size(8)));
template <class Lanes>
inline void cut_lanes(const float* from, const float* cuts, float uncut, float* to) {
  Lanes s, r;
  std::memcpy(&s, from, sizeof s);
  std::memcpy(&r, cuts, sizeof r);
  const Lanes other = r < uncut ? -r : s, made = s < other ? other : s;
  std::memcpy(to, &made, sizeof made);
}

// Calls visit(first sample, pointers to it in the four leaves along z) for each row of samples. A leaf of one value is
// a row of that value, read repeatedly.
template <class Visit>
void for_rows(std::span<const LeafView, kBlockLeaves> leaves, Visit visit) {
  std::array<std::array<float, kLeafSize>, kBlockLeaves> constants;
  struct Rows {
    const float* data;
    std::size_t step;
  };
  std::array<Rows, kBlockLeaves> rows;
  for (std::size_t i = 0; i < kBlockLeaves; ++i) {
    if (!leaves[i].samples) constants[i].fill(leaves[i].constant);
    rows[i] = leaves[i].samples ? Rows{leaves[i].samples, kLeafSize} : Rows{constants[i].data(), 0};
  }
  for (std::size_t x = 0; x < kSide; ++x)
    for (std::size_t y = 0; y < kSide; ++y) {
      constexpr std::size_t kBefore = kLeafSize - 1;
      const std::size_t lx = x + kBefore, ly = y + kBefore;
      const Rows* column = rows.data() + (lx / kLeafSize * 4 + ly / kLeafSize) * 4;
      const std::size_t row = lx % kLeafSize * kLeafSize + ly % kLeafSize;
      const auto at = [&](std::size_t z) { return column[z].data + column[z].step * row; };
      visit((x * kSide + y) * kSide, at(0) + kBefore, at(1), at(2), at(3));
    }
}

template <int kShift>
void interpolate(const float* coarse, float* out) {
  constexpr std::size_t kFine = std::size_t{1} << kShift, kMask = kFine - 1;
  constexpr auto kCoarse = static_cast<std::size_t>(coarse_side(kShift));
  constexpr float kStep = 1.0f / static_cast<float>(kFine);
  // Rows of samples along z include the samples before the block's first one that its first coarse cell has.
  constexpr std::size_t kWide = (kCoarse - 1) * kFine, kPlane = kSide * kWide;
  static_assert(kWide % 4 == 0 && kWide >= kSide + kMask);
  alignas(64) std::array<float, kCoarse * kCoarse * kWide> lines;
  alignas(64) std::array<float, kPlane> first, second;
  for (std::size_t line = 0; line < kCoarse * kCoarse; ++line)
    for (std::size_t c = 0; c + 1 < kCoarse; ++c) {
      const float from = coarse[line * kCoarse + c], rise = coarse[line * kCoarse + c + 1] - from;
      float* to = lines.data() + line * kWide + c * kFine;
      times<kFine>([&](std::size_t k) { to[k] = from + static_cast<float>(k) * kStep * rise; });
    }
  const auto fill_plane = [&](std::size_t cx, float* plane) {
    for (std::size_t y = 0; y < kSide; ++y) {
      const float* a = lines.data() + (cx * kCoarse + (y + kMask) / kFine) * kWide;
      const float* b = a + kWide;
      float* to = plane + y * kWide;
      const float weight = static_cast<float>((y + kMask) % kFine) * kStep;
      times<kWide>([&](std::size_t i) { to[i] = a[i] + weight * (b[i] - a[i]); });
    }
  };
  float *near_plane = first.data(), *far_plane = second.data();
  for (std::size_t x = 0; x < kSide; ++x) {
    const std::size_t phase = (x + kMask) % kFine;
    if (x == 0 || phase == 0) {
      const std::size_t cx = (x + kMask) / kFine;
      if (x == 0)
        fill_plane(cx, near_plane);
      else
        std::swap(near_plane, far_plane);
      fill_plane(cx + 1, far_plane);
    }
    const float weight = static_cast<float>(phase) * kStep;
    for (std::size_t y = 0; y < kSide; ++y) {
      const float* a = near_plane + y * kWide + kMask;
      const float* b = far_plane + y * kWide + kMask;
      float* to = out + (x * kSide + y) * kSide;
      times<kSide>([&](std::size_t i) { to[i] = a[i] + weight * (b[i] - a[i]); });
    }
  }
}

}  // namespace

void copy_block(std::span<const LeafView, kBlockLeaves> leaves, std::span<float, kBlockVolume> out) {
  for_rows(leaves, [&](std::size_t row, const float* a, const float* b, const float* c, const float* d) {
    float* to = out.data() + row;
    to[0] = a[0];
    times<kLeafSize>([&](std::size_t i) { to[1 + i] = b[i]; });
    times<kLeafSize>([&](std::size_t i) { to[9 + i] = c[i]; });
    to[17] = d[0];
    to[18] = d[1];
  });
}

void cut_block(std::span<const LeafView, kBlockLeaves> leaves, float uncut, std::span<const float, kBlockVolume> from,
               std::span<float, kBlockVolume> to) {
  for_rows(leaves, [&](std::size_t row, const float* a, const float* b, const float* c, const float* d) {
    const float* s = from.data() + row;
    float* f = to.data() + row;
    f[0] = cut(s[0], a[0], uncut);
    for (std::size_t i = 0; i < kLeafSize; i += 4) cut_lanes<Four>(s + 1 + i, b + i, uncut, f + 1 + i);
    for (std::size_t i = 0; i < kLeafSize; i += 4) cut_lanes<Four>(s + 9 + i, c + i, uncut, f + 9 + i);
    cut_lanes<Two>(s + 17, d, uncut, f + 17);
  });
}

void interpolate_block(std::span<const float> coarse, int shift, std::span<float, kBlockVolume> out) {
  OSTEON_CHECK((shift == 1 || shift == 2) &&
               coarse.size() == static_cast<std::size_t>(coarse_side(shift) * coarse_side(shift) * coarse_side(shift)));
  if (shift == 1)
    interpolate<1>(coarse.data(), out.data());
  else
    interpolate<2>(coarse.data(), out.data());
}

}  // namespace osteon
