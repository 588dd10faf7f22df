#include "common/imaging/separation.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace osteon::imaging {
namespace {

// A marker at the deepest voxel of each core.
Result<VoxelMask> markers_from_cores(const VoxelMask& bones, const BoneDepth& depth, const KeepGoing& keep_going) {
  const auto cores = bone_cores(bones, depth, keep_going);
  if (!cores) return tl::unexpected(cores.error());
  VoxelMask markers(bones.dims);
  std::uint8_t number = 0;
  for (const auto& [column, row, slice] : *cores) markers.at(column, row, slice) = ++number;
  return markers;
}

// Numbers from the largest on; equal ones keep their order.
void number_by_size(VoxelMask& labels) {
  std::array<std::int64_t, 256> sizes{};
  for (const std::uint8_t number : labels.values) ++sizes[number];
  std::array<std::uint8_t, 256> order{}, number_of{};
  std::iota(order.begin(), order.end(), std::uint8_t{0});
  std::stable_sort(order.begin() + 1, order.end(), [&](auto a, auto b) { return sizes[a] > sizes[b]; });
  for (std::size_t i = 1; i < order.size(); ++i) number_of[order[i]] = static_cast<std::uint8_t>(i);
  for (std::uint8_t& number : labels.values) number = number_of[number];
}

}  // namespace

Result<VoxelMask> separate_bones(const HuVolume& volume, const VoxelMask& bones, double threshold_hu,
                                 std::span<const BoneSeed> seeds, const KeepGoing& keep_going) {
  auto depth = bone_depth(volume, bones, threshold_hu, part(keep_going, 0.0, 0.4));
  if (!depth) return tl::unexpected(depth.error());
  const KeepGoing marking = part(keep_going, 0.4, 0.6);
  auto markers =
      seeds.empty() ? markers_from_cores(bones, *depth, marking) : markers_from_seeds(bones, *depth, seeds, marking);
  if (!markers) return markers;
  auto labels = watershed(bones, std::move(*depth), std::move(*markers), part(keep_going, 0.6, 1.0));
  if (labels && seeds.empty()) number_by_size(*labels);
  return labels;
}

}  // namespace osteon::imaging
