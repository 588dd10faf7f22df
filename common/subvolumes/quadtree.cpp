#include "common/subvolumes/quadtree.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

namespace osteon::subvolumes {
namespace {

// The one or two parts of an axis.
std::vector<std::array<std::int32_t, 2>> halves(std::int32_t first, std::int32_t last) {
  if (first == last) return {{first, last}};
  const std::int32_t middle = first + (last - first) / 2;
  return {{first, middle}, {middle + 1, last}};
}

std::int64_t sum(const std::vector<std::int64_t>& values) {
  return std::accumulate(values.begin(), values.end(), std::int64_t{0});
}

}  // namespace

Fill fill_of(std::int64_t bone, const CoordBox& box) {
  if (bone == 0) return Fill::empty;
  return bone == voxels_of(box) ? Fill::full : Fill::partly_full;
}

std::int64_t bone_in(const BoneVoxels& voxels, const CoordBox& box) {
  std::int64_t bone = 0;
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const std::uint8_t* row = voxels.bone.data() + voxels.index({box.min.x, y, z});
      bone += box.dims().x - std::count(row, row + box.dims().x, std::uint8_t{0});
    }
  return bone;
}

std::vector<CoordBox> quadrants_of(const CoordBox& box) {
  std::vector<CoordBox> quadrants;
  for (const auto& [first_row, last_row] : halves(box.min.y, box.max.y))
    for (const auto& [first_column, last_column] : halves(box.min.x, box.max.x))
      quadrants.push_back({{first_column, first_row, box.min.z}, {last_column, last_row, box.max.z}});
  return quadrants;
}

std::int64_t uniform_count(const CoordBox& box, int subdivisions) {
  const std::int64_t parts = std::int64_t{1} << subdivisions;
  return std::min<std::int64_t>(parts, box.dims().x) * std::min<std::int64_t>(parts, box.dims().y);
}

std::int64_t SubdivisionCounts::all_full() const { return sum(full); }
std::int64_t SubdivisionCounts::all_empty() const { return sum(empty); }
double SubdivisionCounts::kept() const {
  return uniform == 0 ? 0.0 : static_cast<double>(all_full() + partly_full) / static_cast<double>(uniform);
}

Result<std::vector<SubdivisionCounts>> count_subdivisions(const BoneVoxels& voxels, std::span<const CoordBox> sections,
                                                          int subdivisions, const KeepGoing& keep_going) {
  std::int64_t all_voxels = 0;
  for (const CoordBox& section : sections) all_voxels += voxels_of(section);
  std::vector<SubdivisionCounts> rows;
  std::vector<CoordBox> partly_full(sections.begin(), sections.end());  // to be looked at
  for (int level = 0; level <= subdivisions; ++level) {
    SubdivisionCounts row;
    if (level > 0) row.full = rows.back().full, row.empty = rows.back().empty;
    row.full.push_back(0);
    row.empty.push_back(0);
    for (const CoordBox& section : sections) row.uniform += uniform_count(section, level);
    std::vector<CoordBox> looked_at;
    for (const CoordBox& box : std::exchange(partly_full, {}))
      if (level == 0)
        looked_at.push_back(box);
      else
        std::ranges::copy(quadrants_of(box), std::back_inserter(looked_at));
    for (const CoordBox& box : looked_at) {
      if (!keep_going(static_cast<double>(level) / (subdivisions + 1))) return stopped_while("dividing the bone");
      const Fill fill = fill_of(bone_in(voxels, box), box);
      row.full.back() += fill == Fill::full;
      row.empty.back() += fill == Fill::empty;
      if (fill == Fill::partly_full) partly_full.push_back(box);
    }
    row.partly_full = static_cast<std::int64_t>(partly_full.size());
    row.mean_voxels = row.uniform == 0 ? 0.0 : static_cast<double>(all_voxels) / static_cast<double>(row.uniform);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace osteon::subvolumes
