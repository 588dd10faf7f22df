#include "tests/perf/baselines/leaf_cut.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "tests/perf/baselines/lowering.hpp"

namespace osteon::baselines {
namespace {

constexpr int kLeaf = openvdb::FloatTree::LeafNodeType::DIM;
static_assert(kLeaf == 8);

}  // namespace

LeafCut::LeafCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm)
    : pitch_mm_(pitch_mm), grid_(openvdb::FloatGrid::create(band_mm)), accessor_(grid_->getAccessor()) {
  for (std::size_t k = 0; k < 3; ++k) {
    first_[k] = min[k] & ~(kLeaf - 1);
    last_[k] = max[k] & ~(kLeaf - 1);
  }
}

void LeafCut::lower(const SweptShape& shape, const Near& near) const {
  float* values = near.leaf->buffer().data();
  if (near.removed) {
    std::fill_n(values, kLeaf * kLeaf * kLeaf, -shape.band_mm);
    return;
  }
  const openvdb::Coord& at = near.leaf->origin();
  lower_leaf(shape, static_cast<float>(at.x()) * pitch_mm_, static_cast<float>(at.y()) * pitch_mm_,
             static_cast<float>(at.z()) * pitch_mm_, values);
}

void LeafCut::apply(const SweptShape& shape, int threads) {
  // From the middle of a leaf to its farthest sample, and a quantum for rounding.
  const float half = 0.5f * static_cast<float>(kLeaf - 1) * pitch_mm_, radius = half * std::sqrt(3.0f) + 1e-3f;
  std::array<int, 3> first{}, last{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto leaf_at = [&](float mm) { return static_cast<int>(std::floor(mm / pitch_mm_)) & ~(kLeaf - 1); };
    first[k] = std::max(first_[k], leaf_at(shape.low[k]));
    last[k] = std::min(last_[k], leaf_at(shape.high[k]));
  }
  near_.clear();
  for (int x = first[0]; x <= last[0]; x += kLeaf)
    for (int y = first[1]; y <= last[1]; y += kLeaf)
      for (int z = first[2]; z <= last[2]; z += kLeaf) {
        const float middle =
            distance_mm(shape, static_cast<float>(x) * pitch_mm_ + half, static_cast<float>(y) * pitch_mm_ + half,
                        static_cast<float>(z) * pitch_mm_ + half);
        if (middle >= shape.band_mm + radius) continue;
        near_.push_back({accessor_.touchLeaf({x, y, z}), middle <= -shape.band_mm - radius});
      }
  if (threads > 1) {
    tbb::parallel_for(std::size_t{0}, near_.size(), [&](std::size_t i) { lower(shape, near_[i]); });
    return;
  }
  for (const Near& near : near_) lower(shape, near);
}

}  // namespace osteon::baselines
