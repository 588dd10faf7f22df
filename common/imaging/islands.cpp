#include "common/imaging/islands.hpp"

#include <algorithm>
#include <numeric>

#include "common/imaging/calibration.hpp"
#include "common/imaging/segmentation.hpp"

namespace osteon::imaging {
namespace {

constexpr int kMostNumbers = 255;

// Components of bone, and those of contrast medium after them. Runs are in the order of memory. Error: cancelled.
Result<Components> bone_and_contrast(const VoxelMask& mask, const KeepGoing& keep_going) {
  const bool has_contrast = std::ranges::find(mask.values, mask_value(BoneVoxel::contrast)) != mask.values.end();
  std::bitset<256> wanted;
  wanted.set().reset(0).reset(mask_value(BoneVoxel::contrast));
  auto found = find_components(mask, wanted, Connectivity::corners, part(keep_going, 0.0, has_contrast ? 0.5 : 1.0));
  if (!found || !has_contrast) return found;
  wanted.reset().set(mask_value(BoneVoxel::contrast));
  auto contrast = find_components(mask, wanted, Connectivity::corners, part(keep_going, 0.5, 1.0));
  if (!contrast) return contrast;
  for (VoxelRun& run : contrast->runs) run.component += found->count;
  found->count += contrast->count;
  const auto bones = static_cast<std::ptrdiff_t>(found->runs.size());
  found->runs.insert(found->runs.end(), contrast->runs.begin(), contrast->runs.end());
  std::ranges::inplace_merge(found->runs, found->runs.begin() + bones, {}, [](const VoxelRun& run) {
    return std::array{run.slice, run.row, run.first};
  });
  return found;
}

}  // namespace

Result<Islands> find_islands(const HuVolume& volume, const VoxelMask& bone, const DensityCalibration& calibration,
                             const KeepGoing& keep_going) {
  auto components = bone_and_contrast(bone, part(keep_going, 0.0, 0.6));
  if (!components) return tl::unexpected(components.error());

  struct Sums {
    Island island;
    double density = 0.0;
    Vec3 voxels = Vec3::Zero();
  };
  std::vector<Sums> sums(components->count);
  for (Sums& s : sums) {
    s.island.first = volume.dims;
    s.island.last = {-1, -1, -1};
  }
  std::size_t done = 0;
  for (const VoxelRun& run : components->runs) {
    if ((done++ & 0xffff) == 0 &&
        !keep_going(0.6 + 0.4 * static_cast<double>(done) / static_cast<double>(components->runs.size())))
      return stopped_while("measuring the islands of bone");
    Sums& s = sums[run.component];
    const std::array<int, 3> low{run.first, run.row, run.slice}, high{run.last, run.row, run.slice};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      s.island.first[axis] = std::min(s.island.first[axis], low[axis]);
      s.island.last[axis] = std::max(s.island.last[axis], high[axis]);
    }
    const int count = run.last - run.first + 1;
    s.island.voxels += count;
    s.voxels += count * Vec3(0.5 * (run.first + run.last), run.row, run.slice);
    for (int x = run.first; x <= run.last; ++x)
      s.density += bone_density_g_cm3(calibration, volume.at(x, run.row, run.slice));
  }

  Islands islands;
  std::vector<std::uint32_t> order(sums.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](std::uint32_t i) { return sums[i].island.voxels; });
  islands.number.resize(order.size());
  for (const std::uint32_t i : order) {
    Sums& s = sums[i];
    const auto voxels = static_cast<double>(s.island.voxels);
    s.island.volume_cm3 = voxels * volume.spacing_mm.prod() * 1e-3;
    s.island.density_g_cm3 = s.density / voxels;
    s.island.centre_mm = volume.position_mm(s.voxels / voxels);
    islands.list.push_back(s.island);
    islands.number[i] = static_cast<int>(islands.list.size());
  }
  islands.components = std::move(*components);
  return islands;
}

VoxelMask number_bones(const Islands& islands, std::span<const int> kept, bool merge, const std::array<int, 3>& dims) {
  std::vector<std::uint8_t> bone_of(islands.list.size() + 1, 0);
  int next = 1;
  for (const int island : kept)
    bone_of[static_cast<std::size_t>(island)] = static_cast<std::uint8_t>(merge ? 1 : std::min(next++, kMostNumbers));
  VoxelMask bones(dims);
  for (const VoxelRun& run : islands.components.runs) {
    const std::uint8_t bone = bone_of[static_cast<std::size_t>(islands.number[run.component])];
    if (bone == 0) continue;
    fill_run(bones, run, bone);
  }
  return bones;
}

}  // namespace osteon::imaging
