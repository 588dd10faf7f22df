// The steps from a CT to a case that do not depend on how its bones were found.
#pragma once
#include <array>
#include <bitset>
#include <functional>
#include <optional>
#include <string>

#include "common/imaging/hu_volume.hpp"
#include "common/imaging/segmentation.hpp"
#include "common/imaging/surface_level.hpp"
#include "common/volume/sparse_volume.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/kept_scan.hpp"

namespace osteon::import {

// Shares of the stages in the total time, for one progress bar over all of them.
inline constexpr double kCalibrateEnd = 0.02, kSmoothEnd = 0.05, kFindEnd = 0.1, kSegmentEnd = 0.35, kSurfaceEnd = 0.75,
                        kCortexEnd = 0.85;
inline constexpr const char* kNoMemory =
    "this machine has no memory for a scan of that size; export thicker slices or a smaller region";

// A part of the scan, and the sides on which it ends with the scan.
struct ScanRegion {
  std::array<int, 3> first{}, last{};
  imaging::ScanEnds ends{};
};

// The part around voxels, with everything that the segmentation reads beside them and that the case keeps.
[[nodiscard]] ScanRegion region_around(const std::array<int, 3>& first, const std::array<int, 3>& last,
                                       const imaging::HuVolume& volume, const CtOptions& options);

// Where the voxels of a volume lie, without their values.
[[nodiscard]] imaging::HuVolume without_values(const imaging::HuVolume& volume);

[[nodiscard]] double pitch_mm_of(const imaging::HuVolume& geometry, const CtOptions& options);
// What is wrong with the voxels or the options. Error: invalid_input.
[[nodiscard]] Result<void> check_options(const imaging::HuVolume& geometry, const CtOptions& options, double pitch_mm);

// Applies the filters that the options name. Gives their names for the case's source. Error: cancelled.
[[nodiscard]] Result<std::string> smooth_scan(imaging::HuVolume& scan, const CtOptions& options,
                                              const KeepGoing& keep_going);

// The samples around the bone's voxels: the cell around each, and the band beyond. Error: invalid_input (too many).
[[nodiscard]] Result<CoordBox> lattice_around(const imaging::HuVolume& volume, const std::array<int, 3>& bone_first,
                                              const std::array<int, 3>& bone_last, double pitch_mm);

// The signed distance to the bones in the narrow band around their surface, see imaging::BoneField. Errors: cancelled,
// internal.
[[nodiscard]] Result<SparseVolume> measure_surface(const imaging::HuVolume& volume, const imaging::SparseMask& bones,
                                                   const imaging::SurfaceLevel& level, const CoordBox& lattice,
                                                   double pitch_mm, const KeepGoing& keep_going);

// The same with the surface between slices by imaging::SliceShapes.
[[nodiscard]] Result<SparseVolume> measure_shapes(const imaging::HuVolume& volume, const imaging::SparseMask& bones,
                                                  const imaging::SurfaceLevel& level, const CoordBox& lattice,
                                                  double pitch_mm, const KeepGoing& keep_going);

// What a case says of itself, without labels and threshold.
[[nodiscard]] CaseInfo description(const CtScan& scan, const CtOptions& options, const ScanCalibration& calibration,
                                   double pitch_mm);

// Bones that have a surface.
struct MeasuredBones {
  imaging::HuVolume scan;          // where the voxels of the whole scan lie, at whose ends the bones end
  imaging::HuVolume volume;        // the part of the scan around them
  KnownVoxels known;               // of the part
  std::bitset<256> tissue_labels;  // labels of bone that say the tissue, too
  imaging::VoxelBox keep;          // voxels of the part that the case keeps as its scan
  bool several = false;            // samples get the numbers of their bones
  CoordBox lattice;                // of the samples
  SparseVolume surface_mm;
  std::optional<SparseVolume> change_hu;  // of thin cortex
};

// Makes the case. `list`: describes the labels of the case's scan. Errors: exhausted, cancelled, internal.
[[nodiscard]] Result<CtImport> make_case(MeasuredBones bones, CaseInfo info,
                                         const std::function<void(const CaseScan&, CaseInfo&)>& list,
                                         const KeepGoing& keep_going);

}  // namespace osteon::import
