// Bones that grow from seeds in a scan, instead of all voxels at or above a threshold.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/imaging/bone_markers.hpp"
#include "common/imaging/region_growing.hpp"

namespace osteon::import {

struct GrowOptions {
  std::vector<Vec3> seeds_mm;        // LPS; empty: no growing
  std::vector<int> bones;            // number of each seed's bone if bones are separated; empty: 1, 2, 3, ...
  int outside = 0;                   // the number in `bones` that is taken away again; 0: none
  std::optional<double> similar_hu;  // to the seed, or to the mean of the region; absent: bone reaches the threshold
  bool adaptive = false;             // to the mean
  imaging::GrowBy by = imaging::GrowBy::volume;
};

struct GrownBones {
  imaging::VoxelMask labels;             // of the scan's voxels: 0, or the number of a region
  std::vector<imaging::BoneSeed> seeds;  // voxel of each seed, and the number of its bone
  std::vector<imaging::Region> regions;  // one for each seed that lies in no earlier region
  double threshold_hu = 0.0;             // at the bones' surface: the lowest that a region takes
  std::string description;               // for the case's source
};

// `threshold_hu`: for bones that reach it. Errors: invalid_input (a seed outside the scan or below the threshold,
// limits that are not positive numbers), cancelled.
[[nodiscard]] Result<GrownBones> grow_bones(const imaging::HuVolume& scan, const GrowOptions& options,
                                            double threshold_hu, const KeepGoing& keep_going);

// A position as "X,Y,Z", mm. Error: invalid_input.
[[nodiscard]] Result<Vec3> parse_seed(const std::string& text);

}  // namespace osteon::import
