// The list of sub-volumes (Niu 2008, §5.2.3): boxes of voxels with their own HU. Cutting changes, divides and removes
// them (Niu 2008, §5.4).
#pragma once
#include <list>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/subvolumes/bone_voxels.hpp"
#include "common/subvolumes/quadtree.hpp"

namespace osteon::subvolumes {

// A block of voxels with a copy of their values: columns fastest, then rows, then slices of its box.
struct SubVolume {
  CoordBox box;
  int section = 0;  // from 0
  int level = 0;    // how often its section was divided
  Fill fill = Fill::full;
  std::int64_t bone = 0;  // voxels
  std::vector<std::int16_t> hu = {};
  std::vector<std::uint8_t> is_bone = {};  // not 0: bone

  [[nodiscard]] std::size_t index(Coord voxel) const {
    const Coord dims = box.dims();
    return (to_index(voxel.z - box.min.z) * to_index(dims.y) + to_index(voxel.y - box.min.y)) * to_index(dims.x) +
           to_index(voxel.x - box.min.x);
  }
};

// Not synchronised.
class SubVolumeList {
 public:
  // Divides the sections `subdivisions` times, and copies what is not empty. No two sub-volumes share a voxel, and
  // together they have all bone of the sections. Error: cancelled.
  [[nodiscard]] static Result<SubVolumeList> divide(const BoneVoxels& voxels, std::span<const CoordBox> sections,
                                                    int subdivisions, const KeepGoing& keep_going);

  // In the order of the sections, and of their quadrants: rows slowest.
  [[nodiscard]] const std::list<SubVolume>& all() const { return all_; }
  [[nodiscard]] std::int64_t bone() const;    // voxels of bone
  [[nodiscard]] std::int64_t voxels() const;  // of all sub-volumes
  [[nodiscard]] std::size_t memory_bytes() const;

  using Place = std::list<SubVolume>::iterator;
  [[nodiscard]] std::vector<Place> places();

  // What update() did with a sub-volume.
  struct Update {
    int made = 0;     // sub-volumes, by dividing one that was full
    int removed = 0;  // because they became empty
  };
  // After voxels of a sub-volume were removed: takes the sub-volume from the list if it is empty now. Divides it if it
  // was full and is coarser than the list's subdivisions; quadrants that are empty are not kept. `place` is no longer
  // valid.
  Update update(Place place);

 private:
  explicit SubVolumeList(int subdivisions) : subdivisions_(subdivisions) {}
  void divide_further(Place place, Update& done);

  int subdivisions_;
  std::list<SubVolume> all_;
};

}  // namespace osteon::subvolumes
