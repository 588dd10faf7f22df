#include "common/subvolumes/subvolume_list.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace osteon::subvolumes {
namespace {

// Copies a box of voxels out of a block of them. `index`: of a voxel in the block.
template <class Index>
SubVolume copied(std::span<const std::int16_t> hu, std::span<const std::uint8_t> bone, const CoordBox& box,
                 Index index) {
  SubVolume part{.box = box};
  const auto count = static_cast<std::size_t>(voxels_of(box));
  part.hu.reserve(count);
  part.is_bone.reserve(count);
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const std::size_t first = index(Coord{box.min.x, y, z}), columns = to_index(box.dims().x);
      part.hu.insert(part.hu.end(), hu.begin() + static_cast<std::ptrdiff_t>(first),
                     hu.begin() + static_cast<std::ptrdiff_t>(first + columns));
      part.is_bone.insert(part.is_bone.end(), bone.begin() + static_cast<std::ptrdiff_t>(first),
                          bone.begin() + static_cast<std::ptrdiff_t>(first + columns));
    }
  part.bone = std::ranges::count_if(part.is_bone, [](std::uint8_t voxel) { return voxel != 0; });
  part.fill = fill_of(part.bone, box);
  return part;
}

}  // namespace

Result<SubVolumeList> SubVolumeList::divide(const BoneVoxels& voxels, std::span<const CoordBox> sections,
                                            int subdivisions, const KeepGoing& keep_going) {
  SubVolumeList list(subdivisions);
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(sections.size())))
      return stopped_while("dividing the bone");
    SubVolume root = copied(voxels.hu, voxels.bone, sections[i], [&](Coord voxel) { return voxels.index(voxel); });
    if (root.fill == Fill::empty) continue;
    root.section = static_cast<int>(i);
    list.all_.push_back(std::move(root));
    Update ignored;
    list.divide_further(std::prev(list.all_.end()), ignored);
  }
  return list;
}

std::int64_t SubVolumeList::bone() const {
  std::int64_t sum = 0;
  for (const SubVolume& part : all_) sum += part.bone;
  return sum;
}

std::int64_t SubVolumeList::voxels() const {
  std::int64_t sum = 0;
  for (const SubVolume& part : all_) sum += voxels_of(part.box);
  return sum;
}

std::size_t SubVolumeList::memory_bytes() const {
  constexpr std::size_t kNode = sizeof(SubVolume) + 2 * sizeof(void*);  // of the list
  std::size_t sum = 0;
  for (const SubVolume& part : all_) sum += kNode + part.hu.capacity() * sizeof(std::int16_t) + part.is_bone.capacity();
  return sum;
}

std::vector<SubVolumeList::Place> SubVolumeList::places() {
  std::vector<Place> places;
  for (Place place = all_.begin(); place != all_.end(); ++place) places.push_back(place);
  return places;
}

// Replaces a sub-volume that is partly full by its quadrants, and those by theirs.
void SubVolumeList::divide_further(Place place, Update& done) {
  if (place->fill != Fill::partly_full || place->level >= subdivisions_) return;
  const std::vector<CoordBox> quadrants = quadrants_of(place->box);
  if (quadrants.size() == 1) return;  // of one column and one row
  for (const CoordBox& box : quadrants) {
    SubVolume part = copied(place->hu, place->is_bone, box, [&](Coord voxel) { return place->index(voxel); });
    if (part.fill == Fill::empty) {
      ++done.removed;
      continue;
    }
    part.section = place->section;
    part.level = place->level + 1;
    ++done.made;
    divide_further(all_.insert(place, std::move(part)), done);
  }
  all_.erase(place);
}

SubVolumeList::Update SubVolumeList::update(Place place) {
  Update done;
  place->bone = std::ranges::count_if(place->is_bone, [](std::uint8_t voxel) { return voxel != 0; });
  place->fill = fill_of(place->bone, place->box);
  if (place->fill == Fill::empty) {
    all_.erase(place);
    ++done.removed;
  } else {
    divide_further(place, done);
  }
  return done;
}

}  // namespace osteon::subvolumes
