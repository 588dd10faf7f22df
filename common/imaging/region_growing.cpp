#include "common/imaging/region_growing.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <string>

#include "common/core/check.hpp"
#include "common/core/large_pages.hpp"

namespace osteon::imaging {
namespace {

constexpr std::uint32_t kQuestion = 1 << 12;  // runs between two questions whether to go on

std::string text_of(const Vec3& position_mm) {
  std::array<char, 100> text{};
  std::snprintf(text.data(), text.size(), "%.1f, %.1f, %.1f mm", position_mm.x(), position_mm.y(), position_mm.z());
  return text.data();
}

// The voxels that a fixed region may still take: those that are similar and have no label. One bit for each voxel of
// the volume, in words of 64. Bits are only worked out where the region gets, `words_at_once` together: many for
// regions that get far, because memory is fastest in order, and few for small ones.
template <class Label, std::size_t words_at_once>
class OpenVoxels {
 public:
  OpenVoxels(const HuVolume& volume, const std::vector<Label>& labels)
      : hu_(volume.values),
        labels_(labels),
        words_(zeros<std::uint64_t>((hu_.size() + 63) / 64)),
        owner_(words_.size() / words_at_once + 1) {}

  // For the region with this number, which takes `low` to `high` HU.
  void start(Label number, std::int16_t low, std::int16_t high) {
    number_ = number;
    low_ = low;
    high_ = high;
  }

  // The first voxel from `at` on that is open, or `end`.
  std::size_t next_open(std::size_t at, std::size_t end) { return next(at, end, 0); }
  std::size_t next_closed(std::size_t at, std::size_t end) { return next(at, end, kAll); }

  // The first of the open voxels that end before `at`, or `begin`.
  std::size_t run_begin(std::size_t at, std::size_t begin) {
    while (at > begin) {
      const std::uint64_t closed = ~word((at - 1) / 64) << (63 - (at - 1) % 64);
      if (closed != 0) return std::max(at - static_cast<std::size_t>(std::countl_zero(closed)), begin);
      at = (at - 1) / 64 * 64;
    }
    return begin;
  }

  void close(std::size_t begin, std::size_t end) {
    while (begin < end) {
      const std::size_t length = std::min(64 - begin % 64, end - begin);
      word(begin / 64) &= ~(kAll >> (64 - length) << begin % 64);
      begin += length;
    }
  }

 private:
  static constexpr std::uint64_t kAll = ~std::uint64_t{0};

  std::size_t next(std::size_t at, std::size_t end, std::uint64_t flip) {
    while (at < end) {
      const std::uint64_t rest = (word(at / 64) ^ flip) >> at % 64;
      if (rest != 0) return std::min(at + static_cast<std::size_t>(std::countr_zero(rest)), end);
      at = (at / 64 + 1) * 64;
    }
    return end;
  }

  std::uint64_t& word(std::size_t index) {
    const std::size_t block = index / words_at_once;
    if (owner_[block] != number_) work_out(block);
    return words_[index];
  }

  // Not inlined, so that the loops over words stay short.
  [[gnu::noinline]] void work_out(std::size_t block) {
    owner_[block] = number_;
    const std::size_t begin = block * words_at_once, end = std::min(begin + words_at_once, words_.size());
    for (std::size_t i = begin; i < end; ++i) words_[i] = open_word(64 * i);
  }

  [[nodiscard]] std::uint64_t open_word(std::size_t begin) const {
    const std::int16_t* hu = hu_.data() + begin;
    const Label* label = labels_.data() + begin;
    const std::size_t length = std::min<std::size_t>(64, hu_.size() - begin);
    const std::int16_t low = low_, high = high_;
    // No branch, so that the loop is vectorised.
    const std::uint64_t word = packed(length, [=](std::size_t i) { return (low <= hu[i]) & (hu[i] <= high); });
    if (number_ == 1) return word;  // nothing else has a label
    return word & packed(length, [=](std::size_t i) { return label[i] == 0; });
  }

  // Bit i: is(i).
  template <class Is>
  static std::uint64_t packed(std::size_t length, const Is& is) {
    std::array<std::uint8_t, 64> bytes{};
    const auto ask = [&](std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(is(i));
    };
    length == 64 ? ask(64) : ask(length);  // the compiler unrolls a loop of known length
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < 64; i += 8) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, bytes.data() + i, 8);
      word |= eight * 0x0102040810204080 >> 56 << i;  // collects the lowest bit of each byte in the highest byte
    }
    return word;
  }

  const std::vector<std::int16_t>& hu_;
  const std::vector<Label>& labels_;
  std::vector<std::uint64_t> words_;
  std::vector<Label> owner_;  // of each block of words: the region for which it was worked out
  Label number_ = 0;
  std::int16_t low_ = 0, high_ = 0;
};

// Grows regions into an array of labels, in which 0 means none.
template <class Label, std::size_t words_at_once>
class Growth {
 public:
  Growth(const HuVolume& volume, const GrowingParams& params, std::vector<Label>& labels, const KeepGoing& keep_going)
      : volume_(volume),
        params_(params),
        adaptive_(params.similarity == Similarity::mean),
        labels_(labels),
        keep_going_(keep_going),
        open_(volume, labels) {}

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
    region_.low_hu = low;
    region_.high_hu = high;
    if (adaptive_) {
      take({column, column, row, slice});
    } else {
      // The seed itself is similar, so HU lie on both sides.
      open_.start(number, static_cast<std::int16_t>(std::ceil(std::max<double>(low, kLeast_hu))),
                  static_cast<std::int16_t>(std::floor(std::min<double>(high, kMost_hu))));
      offer(column, column, row, slice);
    }
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
    if (adaptive_) {
      const double mean = static_cast<double>(sum_) / static_cast<double>(count_);
      region.low_hu = mean - params_.tolerance_hu;
      region.high_hu = mean + params_.tolerance_hu;
    }
    return region;
  }

 private:
  static constexpr std::int16_t kLeast_hu = std::numeric_limits<std::int16_t>::min();
  static constexpr std::int16_t kMost_hu = std::numeric_limits<std::int16_t>::max();

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
    if (adaptive_) {  // then a run is one voxel
      sum_ += volume_.values[begin];
      ++count_;
    } else {
      open_.close(begin, begin + length);
    }
  }

  // Takes what is similar of the voxels from column `from` to `to` that have no label.
  void offer(int from, int to, int row, int slice) {
    if (row < 0 || row >= volume_.dims[1] || slice < 0 || slice >= volume_.dims[2]) return;
    from = std::max(from, 0);
    to = std::min(to, volume_.dims[0] - 1);
    const std::size_t begin = volume_.index(0, row, slice);
    if (adaptive_) {
      const std::int16_t* hu = volume_.values.data() + begin;
      const Label* label = labels_.data() + begin;
      for (int column = from; column <= to; ++column)
        if (label[column] == 0 && is_near_mean(hu[column])) take({column, column, row, slice});
      return;
    }
    // The whole run of open voxels of which a part is beside the region.
    const std::size_t row_end = begin + static_cast<std::size_t>(volume_.dims[0]);
    const std::size_t end = begin + static_cast<std::size_t>(to) + 1;
    std::size_t at = begin + static_cast<std::size_t>(from);
    while ((at = open_.next_open(at, end)) < end) {
      const std::size_t first = open_.run_begin(at, begin);
      at = open_.next_closed(at, row_end);
      take({static_cast<int>(first - begin), static_cast<int>(at - begin) - 1, row, slice});
    }
  }

  // |hu - sum / count| <= tolerance, without a division.
  [[nodiscard]] bool is_near_mean(std::int16_t hu) const {
    const std::int64_t difference = std::abs(hu * count_ - sum_);
    return static_cast<double>(difference) <= params_.tolerance_hu * static_cast<double>(count_);
  }

  // The last run is the nearest in memory. Only an adaptive region depends on the order.
  VoxelRun next_in_queue() {
    const VoxelRun run = adaptive_ ? queue_.front() : queue_.back();
    adaptive_ ? queue_.pop_front() : queue_.pop_back();
    return run;
  }

  bool flood() {
    const int slices = params_.by == GrowBy::slice ? 0 : 1;
    const bool corners = params_.connectivity == Connectivity::corners;
    while (!queue_.empty()) {
      const auto done = static_cast<double>(taken_) / static_cast<double>(labels_.size());
      if (asked_++ % kQuestion == 0 && !keep_going_(done)) return false;
      const VoxelRun run = next_in_queue();
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
  const bool adaptive_;
  std::vector<Label>& labels_;
  const KeepGoing& keep_going_;
  OpenVoxels<Label, words_at_once> open_;
  std::deque<VoxelRun> queue_;
  Region region_;
  Label number_ = 0;
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
  Growth<std::uint8_t, 64> growth(volume, params, found.labels.values, keep_going);
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
  map.labels = zeros<std::uint32_t>(volume.count());
  Growth<std::uint32_t, 1> growth(volume, params, map.labels, keep_going);
  for (int slice = 0; slice < volume.dims[2]; ++slice)
    for (int row = 0; row < volume.dims[1]; ++row)
      for (int column = 0; column < volume.dims[0]; ++column)
        if (map.labels[volume.index(column, row, slice)] == 0 && !growth.grow({column, row, slice}, ++map.count))
          return stopped_growing();
  return map;
}

}  // namespace osteon::imaging
