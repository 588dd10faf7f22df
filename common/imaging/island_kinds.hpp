// Says what the islands of a scan are. A table, a cast and metal reach the threshold of bone too.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/imaging/islands.hpp"

namespace osteon::imaging {

enum class IslandKind : std::uint8_t {
  bone,
  table,  // or a headrest, or other equipment beside the patient
  cast,   // a shell around a limb
  metal,
  contrast,  // blood or another fluid with contrast medium
};
// "bone", "table", "cast", "metal" or "contrast".
[[nodiscard]] std::string_view name_of(IslandKind kind);

// What an island is, and the facts that decide. Shares are from 0 to 1.
struct IslandNature {
  IslandKind kind = IslandKind::bone;
  double metal = 0.0;         // share of its voxels with the HU of metal
  double at_air = 0.0;        // share of its surface with air right beside it
  double exposed = 0.0;       // share of its surface that one sees from outside the patient; 0 unless it may be no bone
  double thickness_mm = 0.0;  // 2 volume / surface: the thickness of a plate, the radius of a rod
};

// What each island is, in the order of the list:
// - contrast, if its voxels are marked as contrast medium,
// - metal, if at least half of its voxels have `metal_hu` or more, or nearly all of them touch such voxels,
// - a cast, if it is a thin shell that one sees from outside, and it lies on all sides around bone,
// - a table, if it is thin and long, and one sees it from outside,
// - bone in every other case.
// Casts and tables are there only if other islands lie in soft tissue: without a patient, all islands are dry bones.
// `bone`: the mask of find_islands(). Directions of the axes do not matter. Error: cancelled.
[[nodiscard]] Result<std::vector<IslandNature>> name_islands(const HuVolume& volume, const VoxelMask& bone,
                                                             const Islands& islands, double metal_hu,
                                                             const KeepGoing& keep_going);

}  // namespace osteon::imaging
