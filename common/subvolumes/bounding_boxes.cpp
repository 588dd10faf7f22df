#include "common/subvolumes/bounding_boxes.hpp"

#include <algorithm>
#include <limits>

namespace osteon::subvolumes {
namespace {

std::int64_t cost_of(const CoordBox& section) {
  const Coord dims = section.dims();
  return std::int64_t{dims.x} * dims.y * (std::int64_t{dims.z} + 1);
}

}  // namespace

Result<std::vector<CoordBox>> slice_boxes(const BoneVoxels& voxels, const KeepGoing& keep_going) {
  const auto& [columns, rows, slices] = voxels.geometry.dims;
  std::vector<CoordBox> boxes(to_index(slices));
  const std::uint8_t* row_begin = voxels.bone.data();
  for (int z = 0; z < slices; ++z) {
    if (!keep_going(static_cast<double>(z) / slices)) return stopped_while("looking for the bone");
    for (int y = 0; y < rows; ++y, row_begin += columns) {
      const std::uint8_t* row_end = row_begin + columns;
      const auto is_bone = [](std::uint8_t voxel) { return voxel != 0; };
      const std::uint8_t* first = std::find_if(row_begin, row_end, is_bone);
      if (first == row_end) continue;
      const std::uint8_t* last = row_end - 1;
      while (*last == 0) --last;
      boxes[to_index(z)] = box_around(boxes[to_index(z)], {{static_cast<int>(first - row_begin), y, z},
                                                           {static_cast<int>(last - row_begin), y, z}});
    }
  }
  return boxes;
}

CoordBox object_box(std::span<const CoordBox> slices) {
  CoordBox box;
  for (const CoordBox& slice : slices) box = box_around(box, slice);
  return box;
}

std::int64_t section_cost(std::span<const CoordBox> sections) {
  std::int64_t cost = 0;
  for (const CoordBox& section : sections) cost += cost_of(section);
  return cost;
}

std::vector<CoordBox> section_boxes(std::span<const CoordBox> slices) {
  // The cheapest division of the slices from each one to the last, and the first section of that division.
  std::vector<std::int64_t> cheapest(slices.size() + 1, 0);
  std::vector<CoordBox> first_section(slices.size());
  for (std::size_t begin = slices.size(); begin-- > 0;) {
    if (slices[begin].empty()) {
      cheapest[begin] = cheapest[begin + 1];
      continue;
    }
    cheapest[begin] = std::numeric_limits<std::int64_t>::max();
    CoordBox section;
    for (std::size_t end = begin; end < slices.size() && !slices[end].empty(); ++end) {
      section = box_around(section, slices[end]);
      const std::int64_t cost = cost_of(section) + cheapest[end + 1];
      if (cost > cheapest[begin]) continue;  // of equal ones the highest section
      cheapest[begin] = cost;
      first_section[begin] = section;
    }
  }
  std::vector<CoordBox> sections;
  for (std::size_t at = 0; at < slices.size();) {
    if (slices[at].empty()) {
      ++at;
      continue;
    }
    sections.push_back(first_section[at]);
    at += to_index(first_section[at].dims().z);
  }
  return sections;
}

}  // namespace osteon::subvolumes
