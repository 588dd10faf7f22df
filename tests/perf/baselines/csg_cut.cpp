#include "tests/perf/baselines/csg_cut.hpp"

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

#include "tests/perf/baselines/lowering.hpp"

namespace osteon::baselines {
namespace {

constexpr int kLeaf = 8;

// The level set of a body in a box of samples. `distance` gives its distance at a point, `fill` the 512 clipped samples
// of a leaf from its lowest corner on.
template <class Distance, class Fill>
openvdb::FloatGrid::Ptr level_set(const std::array<int, 3>& min, const std::array<int, 3>& max, float pitch, float band,
                                  Distance distance, Fill fill) {
  auto grid = openvdb::FloatGrid::create(band);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  auto accessor = grid->getAccessor();
  const float half = 0.5f * (kLeaf - 1) * pitch, radius = half * std::sqrt(3.0f) + 1e-3f;
  const auto corner = [](int at) { return at & ~(kLeaf - 1); };
  for (int x = corner(min[0]); x <= max[0]; x += kLeaf)
    for (int y = corner(min[1]); y <= max[1]; y += kLeaf)
      for (int z = corner(min[2]); z <= max[2]; z += kLeaf) {
        const float x_mm = static_cast<float>(x) * pitch, y_mm = static_cast<float>(y) * pitch,
                    z_mm = static_cast<float>(z) * pitch;
        const float middle = distance(x_mm + half, y_mm + half, z_mm + half);
        if (std::abs(middle) >= band + radius) continue;
        auto* leaf = accessor.touchLeaf({x, y, z});
        float* values = leaf->buffer().data();
        fill(x_mm, y_mm, z_mm, values);
        for (unsigned i = 0; i < kLeaf * kLeaf * kLeaf; ++i)
          if (std::abs(values[i]) < band) leaf->setValueOn(i);
      }
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

}  // namespace

CsgCut::CsgCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm,
               const std::function<float(float, float, float)>& bone_mm)
    : pitch_mm_(pitch_mm) {
  bone_ = level_set(min, max, pitch_mm, band_mm, bone_mm, [&](float x, float y, float z, float* values) {
    for (int i = 0; i < kLeaf; ++i)
      for (int j = 0; j < kLeaf; ++j)
        for (int k = 0; k < kLeaf; ++k)
          *values++ = std::clamp(bone_mm(x + static_cast<float>(i) * pitch_mm, y + static_cast<float>(j) * pitch_mm,
                                         z + static_cast<float>(k) * pitch_mm),
                                 -band_mm, band_mm);
  });
}

void CsgCut::apply(const SweptShape& shape) {
  // The whole tool near the bone: a level set that is open where it leaves its box would be flooded wrongly.
  std::array<int, 3> min{}, max{};
  for (std::size_t k = 0; k < 3; ++k) {
    min[k] = static_cast<int>(std::floor(shape.low[k] / pitch_mm_));
    max[k] = static_cast<int>(std::ceil(shape.high[k] / pitch_mm_));
  }
  auto tool = level_set(
      min, max, pitch_mm_, shape.band_mm, [&](float x, float y, float z) { return distance_mm(shape, x, y, z); },
      [&](float x, float y, float z, float* values) { lower_leaf(shape, x, y, z, values); });
  openvdb::tools::csgDifference(*bone_, *tool);
}

}  // namespace osteon::baselines
