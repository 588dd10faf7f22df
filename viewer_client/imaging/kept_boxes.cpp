#include "viewer_client/imaging/kept_boxes.hpp"

#include <algorithm>

#include "common/subvolumes/bounding_boxes.hpp"
#include "common/subvolumes/subvolume_list.hpp"

namespace osteon {

namespace {

using subvolumes::BoneVoxels;

constexpr double kSearchEnd = 0.5;  // of the time: the boxes of the slices are known

Result<std::vector<CoordBox>> boxes_of_slices(KeptSlices& slices, const ScanGeometry& scan,
                                              const KeepGoing& keep_going) {
  std::vector<CoordBox> boxes;
  ScanGeometry one = scan;
  one.dims[2] = 1;
  for (int z = 0; z < scan.dims[2]; ++z) {
    const auto found = subvolumes::slice_boxes(BoneVoxels{one, {}, slices.slice(z)},
                                               [&](double) { return keep_going(kSearchEnd * z / scan.dims[2]); });
    if (!found) return found;
    boxes.push_back(found->front());
    if (!boxes.back().empty()) boxes.back().min.z = boxes.back().max.z = z;
  }
  return boxes;
}

// The kept voxels of a box.
std::vector<std::uint8_t> voxels_in(KeptSlices& slices, const ScanGeometry& scan, const CoordBox& box) {
  std::vector<std::uint8_t> voxels;
  voxels.reserve(static_cast<std::size_t>(subvolumes::voxels_of(box)));
  for (int z = box.min.z; z <= box.max.z; ++z) {
    const auto slice = slices.slice(z);
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const auto row =
          slice.subspan(to_index(y) * to_index(scan.dims[0]) + to_index(box.min.x), to_index(box.dims().x));
      voxels.insert(voxels.end(), row.begin(), row.end());
    }
  }
  return voxels;
}

DrawnBox drawn_box(const CoordBox& box, const std::array<std::uint8_t, 3>& colour, bool wide, bool dashed) {
  return {{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}, colour, wide, dashed};
}

}  // namespace

std::int64_t KeptBoxes::section_voxels() const {
  std::int64_t sum = 0;
  for (const CoordBox& section : sections) sum += subvolumes::voxels_of(section);
  return sum;
}

std::int64_t KeptBoxes::full_leaves() const { return std::ranges::count(leaves, true, &KeptLeaf::full); }

int KeptBoxes::section_at(const std::array<int, 3>& voxel) const {
  const auto found = std::ranges::find_if(sections, [&](const CoordBox& section) {
    return section.contains({voxel[0], voxel[1], voxel[2]});
  });
  return found == sections.end() ? -1 : static_cast<int>(found - sections.begin());
}

Result<KeptBoxes> kept_boxes(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                             int subdivisions, const KeepGoing& keep_going) {
  KeptBoxes boxes;
  KeptSlices slices(scan, islands, kept);
  if (slices.bones().none()) return boxes;
  const auto of_slices = boxes_of_slices(slices, scan, keep_going);
  if (!of_slices) return tl::unexpected(of_slices.error());
  boxes.object = subvolumes::object_box(*of_slices);
  boxes.sections = subvolumes::section_boxes(*of_slices);
  const KeepGoing dividing = part(keep_going, kSearchEnd, 1.0);
  const double count = static_cast<double>(boxes.sections.size());
  for (std::size_t i = 0; i < boxes.sections.size(); ++i) {
    const CoordBox& section = boxes.sections[i];
    const std::vector<std::uint8_t> bone = voxels_in(slices, scan, section);
    const std::vector<std::int16_t> hu(bone.size());  // the tree needs none
    const Coord dims = section.dims();
    ScanGeometry part_of_scan = scan;
    part_of_scan.dims = {dims.x, dims.y, dims.z};
    const BoneVoxels voxels{part_of_scan, hu, bone};
    const std::array whole{voxels.box()};
    const auto list = subvolumes::SubVolumeList::divide(
        voxels, whole, subdivisions, [&](double) { return dividing(static_cast<double>(i) / count); });
    if (!list) return tl::unexpected(list.error());
    const auto moved = [&](Coord at) { return at + section.min; };
    for (const subvolumes::SubVolume& leaf : list->all())
      boxes.leaves.push_back({{moved(leaf.box.min), moved(leaf.box.max)}, leaf.fill == subvolumes::Fill::full});
  }
  return boxes;
}

std::vector<DrawnBox> drawn_boxes(const KeptBoxes& boxes, int chosen) {
  std::vector<DrawnBox> drawn;
  for (const KeptLeaf& leaf : boxes.leaves)
    drawn.push_back(drawn_box(leaf.box, leaf.full ? kFullColour : kPartlyFullColour, false, !leaf.full));
  if (!boxes.object.empty()) drawn.push_back(drawn_box(boxes.object, kObjectColour, false, true));
  for (const CoordBox& section : boxes.sections) drawn.push_back(drawn_box(section, kSectionColour, false, false));
  if (chosen >= 0 && to_index(chosen) < boxes.sections.size())
    drawn.push_back(drawn_box(boxes.sections[to_index(chosen)], kChosenColour, true, false));
  return drawn;
}

}  // namespace osteon
