// Finds the bone voxels of a scan: those at or above a threshold, and the marrow and cancellous bone within them.
#pragma once
#include <array>
#include <cstdint>

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
  contrast = 4,    // contrast medium, no bone: see mark_contrast()
};
[[nodiscard]] constexpr std::uint8_t mask_value(BoneVoxel voxel) { return static_cast<std::uint8_t>(voxel); }

struct SegmentationParams {
  double threshold_hu = kBoneThreshold_hu;
  // Smallest HU of cancellous bone that dense bone does not enclose, as at a saw cut. [A] Above muscle, blood and discs
  // without contrast medium (30 to 110 HU), below healthy cancellous bone.
  double cancellous_hu = 130.0;
  // [A] The following lengths and the limit of air are assumptions too.
  double bridged_mm = 1.5;  // radius: narrower openings in dense bone, as for vessels, do not open a marrow space
  // radius of the largest sphere in a marrow space; a wider space contains the brain, not marrow
  double widest_mm = 35.0;
  double air_hu = -400.0;  // an enclosed space with a lower average is air, as in a sinus
  bool hollow = false;     // only voxels at or above the threshold are bone
};

// At which sides of the volume the scan ends: columns, rows, slices; first and last. A marrow space cut by the end of
// the scan counts as closed if dense bone surrounds it in the plane of that end.
using ScanEnds = std::array<std::array<bool, 2>, 3>;
inline constexpr ScanEnds kAllScanEnds{{{true, true}, {true, true}, {true, true}}};

// 1 for every voxel at or above the threshold. Errors: invalid_input (no voxel reaches it), cancelled.
[[nodiscard]] Result<VoxelMask> dense_voxels(const HuVolume& volume, double threshold_hu, const KeepGoing& keep_going);

// A marrow space is the space that a ball of `bridged_mm` cannot reach from outside the bone, if such a ball fits
// inside it. Every hole that no path of voxels leaves is one too. So narrow clefts on the outside of a bone, such as
// sutures and joints, stay open. Cancellous bone has `cancellous_hu` or more on most of a voxel's 27 voxels. It lies on
// a straight line between two dense voxels, and is wider than a joint. Most of the connected voxels of that brightness
// must fulfil this too. Errors: invalid_input (no voxel reaches the threshold), cancelled.
[[nodiscard]] Result<VoxelMask> segment_bone(const HuVolume& volume, const SegmentationParams& params,
                                             const ScanEnds& ends, const KeepGoing& keep_going);

// The same for dense bone that was found in another way: 1 in `dense`. Contrast medium in it stays what it is, and
// neither encloses bone nor is enclosed by it.
[[nodiscard]] Result<VoxelMask> segment_bone(const HuVolume& volume, VoxelMask dense, const SegmentationParams& params,
                                             const ScanEnds& ends, const KeepGoing& keep_going);

}  // namespace osteon::imaging
