// Which voxels of a scan are bone: those at or above a threshold, and the marrow and cancellous bone within them.
#pragma once
#include <array>

#include "common/imaging/calibration.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// Values of a mask that segment_bone() makes.
enum class BoneVoxel : std::uint8_t {
  none = 0,
  dense = 1,       // at or above the threshold
  cancellous = 2,  // below it, between dense bone
  marrow = 3,      // below it, enclosed by dense and cancellous bone
};

struct SegmentationParams {
  double threshold_hu = kBoneThreshold_hu;
  // Cancellous bone that the dense bone does not close in, as at a saw cut, is at or above this. [A] Above muscle,
  // blood and discs without contrast medium (30 to 110 HU), below healthy cancellous bone.
  double cancellous_hu = 130.0;
  // [A] The lengths and air's limit too.
  double bridged_mm = 1.5;  // radius: narrower openings in dense bone, as for vessels, do not make a marrow space open
  double widest_mm = 35.0;  // radius of the largest sphere in a marrow space; a wider one is the brain's, not marrow
  double air_hu = -400.0;   // what is enclosed and below this on average is air, as in a sinus
  bool hollow = false;      // only what is at or above the threshold is bone
};

// On which sides the volume ends where the scan ends: columns, rows, slices; first and last. A marrow space that is cut
// by the end of the scan counts as closed where dense bone surrounds it in the plane of that end.
using ScanEnds = std::array<std::array<bool, 2>, 3>;
inline constexpr ScanEnds kAllScanEnds{{{true, true}, {true, true}, {true, true}}};

// A marrow space is what a ball of `bridged_mm` cannot reach from outside the bone, where such a ball has room within,
// and every hole that no path of voxels leaves. So narrow clefts on the outside of a bone, as sutures and joints, stay
// open. Cancellous bone is `cancellous_hu` or more on most of its 27 voxels, lies on a straight line between two dense
// voxels, is wider than a joint, and is so for the most part of what is connected and as bright. Errors: invalid_input
// (no voxel reaches the threshold), cancelled.
[[nodiscard]] Result<VoxelMask> segment_bone(const HuVolume& volume, const SegmentationParams& params,
                                             const ScanEnds& ends, const KeepGoing& keep_going);

}  // namespace osteon::imaging
