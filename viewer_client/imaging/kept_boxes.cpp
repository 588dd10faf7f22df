#include "viewer_client/imaging/kept_boxes.hpp"

#include <algorithm>
#include <functional>
#include <new>

#include "common/subvolumes/bounding_boxes.hpp"
#include "common/subvolumes/quadtree.hpp"

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

// The kept voxels of a box. Error: cancelled.
Result<std::vector<std::uint8_t>> voxels_in(KeptSlices& slices, const ScanGeometry& scan, const CoordBox& box,
                                            const std::function<bool()>& keep_going) {
  std::vector<std::uint8_t> voxels;
  voxels.reserve(static_cast<std::size_t>(subvolumes::voxels_of(box)));
  for (int z = box.min.z; z <= box.max.z; ++z) {
    if (!keep_going()) return stopped_while("reading the bone");
    const auto slice = slices.slice(z);
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const auto row =
          slice.subspan(to_index(y) * to_index(scan.dims[0]) + to_index(box.min.x), to_index(box.dims().x));
      voxels.insert(voxels.end(), row.begin(), row.end());
    }
  }
  return voxels;
}

// Adds the leaves of a box after so many subdivisions, in the order of SubVolumeList. That list would copy the voxels
// at each level. False: somebody stopped it.
bool add_leaves(const BoneVoxels& section, const CoordBox& box, int subdivisions,
                const std::function<bool()>& keep_going, std::vector<KeptLeaf>& leaves) {
  using subvolumes::Fill;
  if (!keep_going()) return false;
  const Fill fill = subvolumes::fill_of(subvolumes::bone_in(section, box), box);
  if (fill == Fill::empty) return true;
  std::vector<CoordBox> quadrants;
  if (fill == Fill::partly_full && subdivisions > 0) quadrants = subvolumes::quadrants_of(box);
  if (quadrants.size() > 1)
    return std::ranges::all_of(quadrants, [&](const CoordBox& quadrant) {
      return add_leaves(section, quadrant, subdivisions - 1, keep_going, leaves);
    });
  leaves.push_back({box, fill == Fill::full});
  return true;
}

// All of them, or those of the chosen section.
std::span<const KeptLeaf> drawn_leaves(const KeptBoxes& boxes, int chosen) {
  std::span<const KeptLeaf> leaves = boxes.leaves;
  if (leaves.size() > kMostDrawnLeaves) leaves = boxes.leaves_of(chosen);
  if (leaves.size() > kMostDrawnLeaves) return {};
  return leaves;
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

std::span<const KeptLeaf> KeptBoxes::leaves_of(int section) const {
  if (section < 0 || to_index(section) >= sections.size()) return {};
  // Sections have no slice in common, and the leaves of one have all its slices.
  const int slice = sections[to_index(section)].min.z;
  const auto slice_of = [](const KeptLeaf& leaf) { return leaf.box.min.z; };
  return {std::ranges::lower_bound(leaves, slice, {}, slice_of), std::ranges::upper_bound(leaves, slice, {}, slice_of)};
}

Result<KeptBoxes> kept_boxes(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                             int subdivisions, const KeepGoing& keep_going) try {
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
    const auto go_on = [&] { return dividing(static_cast<double>(i) / count); };
    const auto bone = voxels_in(slices, scan, section, go_on);
    if (!bone) return tl::unexpected(bone.error());
    const Coord dims = section.dims();
    ScanGeometry part_of_scan = scan;
    part_of_scan.dims = {dims.x, dims.y, dims.z};
    const BoneVoxels voxels{part_of_scan, {}, *bone};
    std::vector<KeptLeaf> leaves;
    if (!add_leaves(voxels, voxels.box(), subdivisions, go_on, leaves)) return stopped_while("dividing the bone");
    for (const KeptLeaf& leaf : leaves)
      boxes.leaves.push_back({{leaf.box.min + section.min, leaf.box.max + section.min}, leaf.full});
  }
  return boxes;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory for the sub-volumes");
}

std::vector<DrawnBox> drawn_boxes(const KeptBoxes& boxes, int chosen) {
  std::vector<DrawnBox> drawn;
  for (const KeptLeaf& leaf : drawn_leaves(boxes, chosen))
    drawn.push_back(drawn_box(leaf.box, leaf.full ? kFullColour : kPartlyFullColour, false, !leaf.full));
  for (const CoordBox& section : boxes.sections) drawn.push_back(drawn_box(section, kSectionColour, false, false));
  // Over the sections, which are seen between its dashes.
  if (!boxes.object.empty()) drawn.push_back(drawn_box(boxes.object, kObjectColour, false, true));
  if (chosen >= 0 && to_index(chosen) < boxes.sections.size())
    drawn.push_back(drawn_box(boxes.sections[to_index(chosen)], kChosenColour, true, false));
  return drawn;
}

}  // namespace osteon
