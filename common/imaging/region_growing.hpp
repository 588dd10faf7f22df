// Grows regions of similar voxels from seeds (Niu 2008, §3.2).
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/calibration.hpp"
#include "common/imaging/components.hpp"
#include "common/imaging/hu_volume.hpp"
#include "common/imaging/voxel_mask.hpp"

namespace osteon::imaging {

// Which voxels a region takes.
enum class Similarity {
  interval,  // fixed: low_hu <= HU <= high_hu
  seed,      // fixed: |HU - HU of the seed| <= tolerance_hu
  mean,      // adaptive: |HU - mean HU of the region so far| <= tolerance_hu
};

enum class GrowBy { slice, volume };

struct GrowingParams {
  Similarity similarity = Similarity::interval;
  double low_hu = kBoneThreshold_hu;
  double high_hu = std::numeric_limits<std::int16_t>::max();
  double tolerance_hu = 200.0;
  GrowBy by = GrowBy::volume;
  // Faces: 4 neighbours in a slice, 6 in the volume. Corners: 8 and 26.
  Connectivity connectivity = Connectivity::faces;
};

struct Region {
  std::array<int, 3> seed{};           // voxel
  std::int64_t voxels = 0;             // with the seed
  std::array<int, 3> first{}, last{};  // voxel box, both ends included
  double low_hu = 0.0, high_hu = 0.0;  // what it takes; of an adaptive region: when its growth ended
};

struct SeededRegions {
  VoxelMask labels;          // 0, or the number of the voxel's region: list[N - 1]
  std::vector<Region> list;  // in the order of their seeds
};

inline constexpr int kMostSeeds = 255;

// The voxel at a position (mm, LPS). Error: invalid_input (outside the scan, or not a number).
[[nodiscard]] Result<std::array<int, 3>> seed_voxel(const HuVolume& volume, const Vec3& position_mm);

// One region from each seed, one after the other. A seed that lies in an earlier region makes none. Voxels of an
// adaptive region wait in a first-in-first-out queue. Each one that leaves it offers its neighbours to the region, in
// the order of memory; a voxel of another region is not taken. A fixed region does not depend on the order.
// By slice, a region first grows in the slice of its seed. Each following slice, first towards the end and then towards
// the beginning of the volume, starts from the voxels beside the region's in the slice before, and grows within itself.
// Errors: invalid_input (no seed, more than kMostSeeds, a seed outside the volume or not similar itself), cancelled.
[[nodiscard]] Result<SeededRegions> grow_from_seeds(const HuVolume& volume, std::span<const std::array<int, 3>> seeds,
                                                    const GrowingParams& params, const KeepGoing& keep_going);

struct RegionMap {
  std::vector<std::uint32_t> labels;  // of each voxel of the volume: the number of its region, from 1
  std::uint32_t count = 0;            // regions
};

// Labels every voxel. The first voxel in memory that has no label is the next seed, until none is left. By slice, no
// region leaves the slice of its seed. `params.similarity`: seed or mean, because an interval says nothing about the
// voxels outside it. Errors: invalid_input (more voxels than numbers of 32 bits), cancelled.
[[nodiscard]] Result<RegionMap> grow_everywhere(const HuVolume& volume, const GrowingParams& params,
                                                const KeepGoing& keep_going);

}  // namespace osteon::imaging
