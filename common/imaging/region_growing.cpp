#include "common/imaging/region_growing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <string>

#include "common/core/check.hpp"

namespace osteon::imaging {
namespace {

constexpr std::uint32_t kQuestion = 1 << 12;  // runs between two questions whether to go on

std::string text_of(const Vec3& position_mm) {
  std::array<char, 100> text{};
  std::snprintf(text.data(), text.size(), "%.1f, %.1f, %.1f mm", position_mm.x(), position_mm.y(), position_mm.z());
  return text.data();
}

// Grows regions into an array of labels, in which 0 means none.
template <class Label>
class Growth {
 public:
  Growth(const HuVolume& volume, const GrowingParams& params, std::vector<Label>& labels, const KeepGoing& keep_going)
      : volume_(volume), params_(params), labels_(labels), keep_going_(keep_going) {}

  // The region from `seed` within its slice or volume. False: stopped.
  bool grow(const std::array<int, 3>& seed, Label number) {
    const auto [column, row, slice] = seed;
    const std::int16_t hu = volume_.at(column, row, slice);
    number_ = number;
    sum_ = count_ = 0;
    region_ = {.seed = seed, .first = volume_.dims, .last = {-1, -1, -1}};
    const bool interval = params_.similarity == Similarity::interval;
    const double low = interval ? params_.low_hu : hu - params_.tolerance_hu;
    const double high = interval ? params_.high_hu : hu + params_.tolerance_hu;
    low_ = static_cast<int>(std::ceil(std::clamp(low, -kBeyond, kBeyond)));
    high_ = static_cast<int>(std::floor(std::clamp(high, -kBeyond, kBeyond)));
    region_.low_hu = low;
    region_.high_hu = high;
    if (params_.similarity == Similarity::mean)
      take({column, column, row, slice});
    else
      offer(column, column, row, slice);
    return flood();
  }

  // Carries the region on from its voxels in slice `from` to slice `to`. False: stopped.
  bool carry_on(int from, int to) {
    for (int row = region_.first[1]; row <= region_.last[1]; ++row) {
      const Label* label = labels_.data() + volume_.index(0, row, from);
      for (int column = region_.first[0]; column <= region_.last[0]; ++column)
        if (label[column] == number_) offer(column, column, row, to);
    }
    return flood();
  }

  [[nodiscard]] bool reaches(int slice) const { return region_.first[2] <= slice && slice <= region_.last[2]; }

  [[nodiscard]] Region region() const {
    Region region = region_;
    if (params_.similarity == Similarity::mean) {
      const double mean = static_cast<double>(sum_) / static_cast<double>(count_);
      region.low_hu = mean - params_.tolerance_hu;
      region.high_hu = mean + params_.tolerance_hu;
    }
    return region;
  }

 private:
  static constexpr double kBeyond = 1e6;  // beyond all HU, and within an int

  // Labels a run of voxels. Its neighbours will be offered when it leaves the queue.
  void take(const VoxelRun& run) {
    const std::size_t begin = volume_.index(run.first, run.row, run.slice);
    const auto length = static_cast<std::size_t>(run.last - run.first + 1);
    std::fill_n(labels_.data() + begin, length, number_);
    queue_.push_back(run);
    region_.voxels += static_cast<std::int64_t>(length);
    taken_ += length;
    region_.first = {std::min(region_.first[0], run.first), std::min(region_.first[1], run.row),
                     std::min(region_.first[2], run.slice)};
    region_.last = {std::max(region_.last[0], run.last), std::max(region_.last[1], run.row),
                    std::max(region_.last[2], run.slice)};
    if (params_.similarity == Similarity::mean) {  // then a run is one voxel
      sum_ += volume_.values[begin];
      ++count_;
    }
  }

  // Takes what is similar of the voxels from column `from` to `to` that have no label.
  void offer(int from, int to, int row, int slice) {
    if (row < 0 || row >= volume_.dims[1] || slice < 0 || slice >= volume_.dims[2]) return;
    from = std::max(from, 0);
    to = std::min(to, volume_.dims[0] - 1);
    const std::size_t begin = volume_.index(0, row, slice);
    const std::int16_t* hu = volume_.values.data() + begin;
    const Label* label = labels_.data() + begin;
    if (params_.similarity == Similarity::mean) {
      for (int column = from; column <= to; ++column)
        if (label[column] == 0 && is_near_mean(hu[column])) take({column, column, row, slice});
      return;
    }
    // The whole run of similar voxels of which a part is beside the region.
    const auto open = [&](int column) { return label[column] == 0 && low_ <= hu[column] && hu[column] <= high_; };
    for (int column = from; column <= to; ++column) {
      if (!open(column)) continue;
      int first = column, last = column;
      while (first > 0 && open(first - 1)) --first;
      while (last + 1 < volume_.dims[0] && open(last + 1)) ++last;
      take({first, last, row, slice});
      column = last;
    }
  }

  // |hu - sum / count| <= tolerance, without a division.
  [[nodiscard]] bool is_near_mean(std::int16_t hu) const {
    const std::int64_t difference = std::abs(hu * count_ - sum_);
    return static_cast<double>(difference) <= params_.tolerance_hu * static_cast<double>(count_);
  }

  bool flood() {
    const int slices = params_.by == GrowBy::slice ? 0 : 1;
    const bool corners = params_.connectivity == Connectivity::corners;
    while (!queue_.empty()) {
      const auto done = static_cast<double>(taken_) / static_cast<double>(labels_.size());
      if (asked_++ % kQuestion == 0 && !keep_going_(done)) return false;
      const VoxelRun run = queue_.front();
      queue_.pop_front();
      for (int dz = -slices; dz <= slices; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
          if (!corners && dy != 0 && dz != 0) continue;
          const int beside = corners || (dy == 0 && dz == 0) ? 1 : 0;
          offer(run.first - beside, run.last + beside, run.row + dy, run.slice + dz);
        }
    }
    return true;
  }

  const HuVolume& volume_;
  const GrowingParams& params_;
  std::vector<Label>& labels_;
  const KeepGoing& keep_going_;
  std::deque<VoxelRun> queue_;
  Region region_;
  Label number_ = 0;
  int low_ = 0, high_ = 0;            // fixed: the HU that are similar
  std::int64_t sum_ = 0, count_ = 0;  // adaptive: of the region's HU
  std::size_t taken_ = 0;             // voxels of all regions
  std::uint32_t asked_ = 0;
};

// Whether a seed can start a region. Error: invalid_input.
Result<void> check_seed(const HuVolume& volume, const std::array<int, 3>& seed, const GrowingParams& params) {
  const Vec3 voxel(seed[0], seed[1], seed[2]);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (seed[axis] < 0 || seed[axis] >= volume.dims[axis])
      return failure(ErrorCode::invalid_input, "the seed at " + text_of(volume.position_mm(voxel)) +
                                                   " lies outside the scan; give a --seed inside it");
  const int hu = volume.at(seed[0], seed[1], seed[2]);
  if (params.similarity != Similarity::interval || (params.low_hu <= hu && hu <= params.high_hu)) return {};
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                " has %d HU, and its region takes %g to %g HU; give another --seed or --threshold", hu, params.low_hu,
                params.high_hu);
  return failure(ErrorCode::invalid_input, "the seed at " + text_of(volume.position_mm(voxel)) + text.data());
}

tl::unexpected<Error> stopped_growing() { return stopped_while("growing regions"); }

}  // namespace

Result<std::array<int, 3>> seed_voxel(const HuVolume& volume, const Vec3& position_mm) {
  if (position_mm.allFinite() && outside_scan_mm(volume, position_mm) <= 0.0) {
    const Vec3 voxel = volume.voxel(position_mm);
    std::array<int, 3> at{};
    // The last face of the scan belongs to its last voxel.
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis] =
          std::clamp(static_cast<int>(std::floor(voxel[static_cast<int>(axis)] + 0.5)), 0, volume.dims[axis] - 1);
    return at;
  }
  const Vec3 last(volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1);
  const Box box = enclosing_box(volume, Vec3::Zero(), last);
  return failure(ErrorCode::invalid_input, "the seed at " + text_of(position_mm) +
                                               " lies outside the scan; give a --seed between " + text_of(box.min_mm) +
                                               " and " + text_of(box.max_mm));
}

Result<SeededRegions> grow_from_seeds(const HuVolume& volume, std::span<const std::array<int, 3>> seeds,
                                      const GrowingParams& params, const KeepGoing& keep_going) {
  if (seeds.empty() || seeds.size() > static_cast<std::size_t>(kMostSeeds))
    return failure(ErrorCode::invalid_input, "regions grow from 1 to " + std::to_string(kMostSeeds) + " seeds, not " +
                                                 std::to_string(seeds.size()));
  OSTEON_CHECK(params.tolerance_hu >= 0.0);
  for (const auto& seed : seeds)
    if (auto good = check_seed(volume, seed, params); !good) return tl::unexpected(good.error());
  SeededRegions found{VoxelMask(volume.dims), {}};
  Growth<std::uint8_t> growth(volume, params, found.labels.values, keep_going);
  for (const auto& seed : seeds) {
    if (found.labels.at(seed[0], seed[1], seed[2]) != 0) continue;
    if (!growth.grow(seed, static_cast<std::uint8_t>(found.list.size() + 1))) return stopped_growing();
    if (params.by == GrowBy::slice)
      for (const int step : {1, -1})
        for (int slice = seed[2] + step; 0 <= slice && slice < volume.dims[2]; slice += step) {
          if (!growth.carry_on(slice - step, slice)) return stopped_growing();
          if (!growth.reaches(slice)) break;
        }
    found.list.push_back(growth.region());
  }
  return found;
}

Result<RegionMap> grow_everywhere(const HuVolume& volume, const GrowingParams& params, const KeepGoing& keep_going) {
  OSTEON_CHECK(params.similarity != Similarity::interval);
  OSTEON_CHECK(params.tolerance_hu >= 0.0);
  if (volume.count() > std::numeric_limits<std::uint32_t>::max())
    return failure(ErrorCode::invalid_input,
                   "a scan of " + describe(volume) + " has too many voxels to label; export a smaller region");
  RegionMap map;
  map.labels.resize(volume.count(), 0);
  Growth<std::uint32_t> growth(volume, params, map.labels, keep_going);
  for (int slice = 0; slice < volume.dims[2]; ++slice)
    for (int row = 0; row < volume.dims[1]; ++row)
      for (int column = 0; column < volume.dims[0]; ++column)
        if (map.labels[volume.index(column, row, slice)] == 0 && !growth.grow({column, row, slice}, ++map.count))
          return stopped_growing();
  return map;
}

}  // namespace osteon::imaging
