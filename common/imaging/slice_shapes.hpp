// The surface of kept bones between slices that are far apart, without steps.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/imaging/bone_field.hpp"

namespace osteon::imaging {

// Whether slices are so far apart, compared with pixels, that HU interpolated between them show steps.
[[nodiscard]] bool has_thick_slices(const HuVolume& volume);

// Shape-based interpolation (Raya 1990). In each slice, the kept bones have a contour where a BoneField crosses the
// threshold. A pixel gets its distance to that contour, positive inside. Between slices the distances are interpolated:
// so the contour of one slice turns into that of the next, where HU would make a step half way between them. The
// interpolation is a cubic with limited slopes (Fritsch 1980), which stays between its two slices. So every voxel keeps
// its side. Bone that ends between two slices is closed by a dome. It fails where a bone moves sideways by more than
// its own width from slice to slice: there it is parted. Any thread.
class SliceShapes {
 public:
  // As BoneField::make(), whose arguments these are. Error: cancelled.
  [[nodiscard]] static Result<SliceShapes> make(const HuVolume& volume, const SparseMask& bones,
                                                const SurfaceLevel& level, const KeepGoing& keep_going);

  // Which samples of a box may be inside.
  [[nodiscard]] Inside inside(const CoordBox& box, double pitch_mm) const;
  // The distances at the samples of a box, z fastest, in a unit of their own. Inside is 0 and more.
  void read(const CoordBox& box, double pitch_mm, std::span<float> out) const;

 private:
  SliceShapes(const HuVolume& volume, BoneField field);

  const HuVolume& volume_;
  BoneField field_;
  double unit_mm_;
  std::vector<std::int16_t> distances_;  // of all voxels, columns fastest
};

}  // namespace osteon::imaging
