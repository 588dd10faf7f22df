#include "server/import/scan_ends.hpp"

#include <algorithm>
#include <vector>

namespace osteon::import {
namespace {

float beyond_mm(const imaging::HuVolume& scan, Coord sample, double pitch_mm) {
  return static_cast<float>(imaging::outside_scan_mm(scan, position_mm(sample, pitch_mm)));
}

// Whether a sample of the part may lie less than `band_mm` within the scan, or beyond it.
bool is_at_end(const imaging::HuVolume& scan, const CoordBox& part, double pitch_mm, float band_mm) {
  // The distance from the scan is convex, so it is largest at a corner of the part.
  float most_mm = beyond_mm(scan, part.min, pitch_mm);
  for (int corner = 1; corner < 8; ++corner)
    most_mm = std::max(
        most_mm, beyond_mm(scan,
                           {(corner & 1) != 0 ? part.max.x : part.min.x, (corner & 2) != 0 ? part.max.y : part.min.y,
                            (corner & 4) != 0 ? part.max.z : part.min.z},
                           pitch_mm));
  return most_mm >= -1.01f * band_mm;
}

}  // namespace

void cap_at_scan(const imaging::HuVolume& scan, const CoordBox& part, double pitch_mm, float band_mm,
                 std::span<float> surface_mm) {
  if (!is_at_end(scan, part, pitch_mm, band_mm)) return;
  float* value = surface_mm.data();
  for (int x = part.min.x; x <= part.max.x; ++x)
    for (int y = part.min.y; y <= part.max.y; ++y)
      for (int z = part.min.z; z <= part.max.z; ++z, ++value)
        if (*value < band_mm) *value = std::min(band_mm, std::max(*value, beyond_mm(scan, {x, y, z}, pitch_mm)));
}

Result<void> cap_at_scan(const imaging::HuVolume& scan, double pitch_mm, SparseVolume& surface_mm,
                         const KeepGoing& keep_going) {
  const float band_mm = surface_mm.background();
  const auto leaf_at = [](Coord origin) {
    return CoordBox{origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}};
  };
  std::vector<Coord> origins = surface_mm.leaves();
  // Bone that is deeper than the band may end with the scan, too.
  for (const Coord origin : surface_mm.constants())
    if (is_at_end(scan, leaf_at(origin), pitch_mm, band_mm)) origins.push_back(origin);
  for (std::size_t i = 0; i < origins.size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(origins.size())))
      return failure(ErrorCode::cancelled, "stopped at the ends of the scan");
    cap_at_scan(scan, leaf_at(origins[i]), pitch_mm, band_mm, {surface_mm.edit_leaf(origins[i]), kLeafVoxels});
  }
  return {};
}

}  // namespace osteon::import
