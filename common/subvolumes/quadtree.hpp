// Quadtree subdivision of sections (Niu 2008, §5.2.2): a box is halved along columns and along rows, and a quadrant
// that is partly full is halved again.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/subvolumes/bone_voxels.hpp"

namespace osteon::subvolumes {

// How many voxels of a box are bone.
enum class Fill : std::uint8_t { empty, partly_full, full };

inline constexpr int kMostSubdivisions = 8;

[[nodiscard]] Fill fill_of(std::int64_t bone, const CoordBox& box);
// Bone voxels in a box that lies in the scan.
[[nodiscard]] std::int64_t bone_in(const BoneVoxels& voxels, const CoordBox& box);

// The quadrants of a box: at most four, with all its slices. Halves differ by one voxel at most, the first being the
// larger. One column or one row is not halved.
[[nodiscard]] std::vector<CoordBox> quadrants_of(const CoordBox& box);

// How many boxes `subdivisions` halvings of all quadrants give (uniform division): 4^n, unless the box has fewer
// columns or rows.
[[nodiscard]] std::int64_t uniform_count(const CoordBox& box, int subdivisions);

// A row of Niu 2008, Table 5.3.
struct SubdivisionCounts {
  std::int64_t uniform = 0;
  // Found by the first, second ... subdivision; the first entry is for the sections themselves.
  std::vector<std::int64_t> full = {}, empty = {};
  std::int64_t partly_full = 0;
  double mean_voxels = 0.0;  // of a box of the uniform division

  [[nodiscard]] std::int64_t all_full() const;
  [[nodiscard]] std::int64_t all_empty() const;
  // Sub-volumes that the quadtree keeps, over those of the uniform division.
  [[nodiscard]] double kept() const;
};
// The rows for 0 to `subdivisions`. Error: cancelled.
[[nodiscard]] Result<std::vector<SubdivisionCounts>> count_subdivisions(const BoneVoxels& voxels,
                                                                        std::span<const CoordBox> sections,
                                                                        int subdivisions, const KeepGoing& keep_going);

}  // namespace osteon::subvolumes
