#include "common/imaging/bone_markers.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <queue>
#include <string>
#include <utility>

#include "common/core/check.hpp"
#include "common/core/large_pages.hpp"
#include "common/imaging/neighbours.hpp"

namespace osteon::imaging {
namespace {

constexpr std::uint32_t kClimbedAtOnce = 1 << 15;  // voxels between two questions whether to go on

tl::unexpected<Error> stopped_looking() { return stopped_while("looking for the cores of bones"); }

// The voxels of the mask, the deepest first; those of one depth in the order of memory.
std::vector<std::uint32_t> deepest_first(const VoxelMask& mask, const BoneDepth& depth) {
  std::vector<std::uint32_t> begin(std::size_t{kDeepest} + 2, 0);
  const auto place = [&](std::size_t voxel) { return static_cast<std::size_t>(kDeepest - depth.values[voxel]); };
  for (std::size_t i = 0; i < mask.values.size(); ++i)
    if (mask.values[i] != 0) ++begin[place(i) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> order(begin.back());
  for (std::size_t i = 0; i < mask.values.size(); ++i)
    if (mask.values[i] != 0) order[begin[place(i)]++] = static_cast<std::uint32_t>(i);
  return order;
}

// Sets that can be joined. The smallest member stands for its set.
class DisjointSets {
 public:
  std::uint32_t add() {
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    return parent_.back();
  }
  std::uint32_t find(std::uint32_t at) {
    while (parent_[at] != at) at = parent_[at] = parent_[parent_[at]];
    return at;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// Cores while the bone is flooded from its deepest voxel up. A core is numbered by its deepest voxel's turn, so the
// smaller number of two is that of the deeper core.
class Cores {
 public:
  explicit Cores(const VoxelMask& mask) : neighbours_(mask.dims), core_(zeros<std::uint32_t>(mask.values.size())) {}

  void add(std::uint32_t voxel, std::uint16_t depth) {
    std::array<std::uint32_t, kDirections> beside{};
    std::size_t count = 0;
    neighbours_.each(voxel, [&](std::uint32_t at, int) {
      if (core_[at] == 0) return;
      const std::uint32_t core = same_core_.find(core_[at] - 1);
      if (std::find(beside.begin(), beside.begin() + count, core) == beside.begin() + count) beside[count++] = core;
    });
    if (count == 0) {
      beside[count++] = same_core_.add();
      same_island_.add();
      peak_.push_back(voxel);
      peak_depth_.push_back(depth);
    }
    const std::uint32_t deepest = *std::min_element(beside.begin(), beside.begin() + count);
    for (std::size_t i = 0; i < count; ++i) {
      if (beside[i] == deepest) continue;
      same_island_.join(deepest, beside[i]);
      if (depth >= kNeck * peak_depth_[beside[i]]) same_core_.join(deepest, beside[i]);
    }
    core_[voxel] = deepest + 1;
  }

  // Deepest voxels of the cores that are at least so deep, or the deepest of their island.
  [[nodiscard]] std::vector<std::uint32_t> peaks(double least_depth) {
    std::vector<std::uint32_t> found;
    for (std::uint32_t core = 0; core < peak_.size(); ++core)
      if (same_core_.find(core) == core && (peak_depth_[core] >= least_depth || same_island_.find(core) == core))
        found.push_back(peak_[core]);
    return found;
  }

 private:
  Neighbours neighbours_;
  std::vector<std::uint32_t> core_;  // of each voxel, from 1; 0: none yet
  DisjointSets same_core_, same_island_;
  std::vector<std::uint32_t> peak_;  // of each core
  std::vector<std::uint16_t> peak_depth_;
};

std::array<int, 3> place_of(std::uint32_t voxel, const std::array<int, 3>& dims) {
  const auto columns = static_cast<std::uint32_t>(dims[0]), rows = static_cast<std::uint32_t>(dims[1]);
  return {static_cast<int>(voxel % columns), static_cast<int>(voxel / columns % rows),
          static_cast<int>(voxel / columns / rows)};
}

// Climbs from seeds, one after the other.
class Climb {
 public:
  Climb(const VoxelMask& mask, const BoneDepth& depth)
      : mask_(mask), depth_(depth.values), neighbours_(mask.dims), came_by_(mask.values.size(), kUnseen) {}

  // The path from a seed up to its core. Error: cancelled.
  Result<std::vector<std::uint32_t>> from(std::uint32_t seed, const KeepGoing& keep_going) {
    // The deepest first, and of those the one that was seen first.
    std::priority_queue<std::pair<std::uint16_t, std::int64_t>> queue;
    std::vector<std::uint32_t> seen;
    const auto see = [&](std::uint32_t voxel, int direction) {
      came_by_[voxel] = static_cast<std::uint8_t>(direction);
      queue.emplace(depth_[voxel], -static_cast<std::int64_t>(seen.size()));
      seen.push_back(voxel);
    };
    see(seed, kNoDirection);
    std::uint32_t deepest = seed;
    for (std::uint32_t asked = 0; !queue.empty(); ++asked) {
      if (asked % kClimbedAtOnce == 0 && !keep_going(0.0)) return stopped_looking();
      const std::uint32_t voxel = seen[static_cast<std::size_t>(-queue.top().second)];
      queue.pop();
      if (depth_[voxel] < kSameCore * depth_[deepest]) break;
      if (depth_[voxel] > depth_[deepest]) deepest = voxel;
      neighbours_.each(voxel, [&](std::uint32_t beside, int direction) {
        if (mask_.values[beside] != 0 && came_by_[beside] == kUnseen) see(beside, direction);
      });
    }
    std::vector<std::uint32_t> path{deepest};
    while (came_by_[path.back()] != kNoDirection)
      path.push_back(neighbours_.moved(path.back(), kDirections - 1 - came_by_[path.back()]));
    for (const std::uint32_t voxel : seen) came_by_[voxel] = kUnseen;
    return path;
  }

 private:
  static constexpr std::uint8_t kUnseen = kDirections;
  const VoxelMask& mask_;
  const std::vector<std::uint16_t>& depth_;
  Neighbours neighbours_;
  std::vector<std::uint8_t> came_by_;  // direction of the step to each voxel
};

}  // namespace

Result<std::vector<std::array<int, 3>>> bone_cores(const VoxelMask& mask, const BoneDepth& depth,
                                                   const KeepGoing& keep_going) {
  if (!keep_going(0.0)) return stopped_looking();
  const std::vector<std::uint32_t> order = deepest_first(mask, depth);
  Cores cores(mask);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i % kClimbedAtOnce == 0 && !keep_going(0.2 + 0.8 * static_cast<double>(i) / static_cast<double>(order.size())))
      return stopped_looking();
    cores.add(order[i], depth.values[order[i]]);
  }
  const std::vector<std::uint32_t> peaks = cores.peaks(kLeastCore_mm / depth.unit_mm);
  if (peaks.size() > std::size_t{kMostMarkers})
    return failure(ErrorCode::exhausted, "the bones have " + std::to_string(peaks.size()) +
                                             " cores, more than 254; --keep fewer islands, or give "
                                             "a --seed in each bone");
  std::vector<std::array<int, 3>> places;
  for (const std::uint32_t peak : peaks) places.push_back(place_of(peak, mask.dims));
  return places;
}

Result<VoxelMask> markers_from_seeds(const VoxelMask& mask, const BoneDepth& depth, std::span<const BoneSeed> seeds,
                                     const KeepGoing& keep_going) {
  constexpr int kShared = 0;
  std::map<std::uint32_t, int> number_of;
  Climb climb(mask, depth);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const BoneSeed& seed = seeds[i];
    OSTEON_CHECK(seed.number >= 1);
    if (seed.number > kMostMarkers)
      return bad_input("seed " + std::to_string(i + 1) + " is of bone " + std::to_string(seed.number) +
                       ", and at most " + std::to_string(kMostMarkers) +
                       " bones can be separated; give fewer seeds, or several of them one bone");
    const auto voxel = static_cast<std::uint32_t>(mask.index(seed.voxel[0], seed.voxel[1], seed.voxel[2]));
    if (mask.values[voxel] == 0)
      return bad_input("seed " + std::to_string(i + 1) + " does not lie in bone; give a --seed inside the bone");
    const auto path = climb.from(voxel, part(keep_going, static_cast<double>(i) / static_cast<double>(seeds.size()),
                                             static_cast<double>(i + 1) / static_cast<double>(seeds.size())));
    if (!path) return tl::unexpected(path.error());
    for (const std::uint32_t at : *path)
      if (const auto [known, fresh] = number_of.try_emplace(at, seed.number); !fresh && known->second != seed.number)
        known->second = kShared;
  }
  VoxelMask markers(mask.dims);
  for (const auto& [voxel, number] : number_of) markers.values[voxel] = static_cast<std::uint8_t>(number);
  // Seeds come last, because the path of another may lead through them.
  VoxelMask taken(mask.dims);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const auto [column, row, slice] = seeds[i].voxel;
    const auto number = static_cast<std::uint8_t>(seeds[i].number);
    if (taken.at(column, row, slice) != 0 && taken.at(column, row, slice) != number)
      return bad_input("seed " + std::to_string(i + 1) +
                       " lies in the voxel of a seed of another bone; give each bone a --seed of its own");
    taken.at(column, row, slice) = markers.at(column, row, slice) = number;
  }
  return markers;
}

}  // namespace osteon::imaging
