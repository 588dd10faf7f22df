#include "common/imaging/bone_depth.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/large_pages.hpp"
#include "common/imaging/neighbours.hpp"

namespace osteon::imaging {
namespace {

constexpr int kHeaviest = 16;  // weight of a millimetre of dense bone, in units of the lightest
constexpr double kDenseAbove_hu = 800.0;
constexpr int kUnitsPerVoxel = 64;                  // of dense bone, along the smallest spacing
constexpr std::uint32_t kMeasuredAtOnce = 1 << 15;  // voxels between two questions whether to go on

// A priority queue of whole levels. Items leave from the lowest level up, those of one level in the order in
// which they came. The level that is being emptied never falls: an item that comes below it joins it.
class BucketQueue {
 public:
  explicit BucketQueue(std::size_t levels) : buckets_(levels) {}

  [[nodiscard]] bool empty() const { return count_ == 0; }
  // Of the next item. The queue is not empty.
  [[nodiscard]] std::size_t level() {
    while (next_ == buckets_[level_].size()) {
      buckets_[level_] = {};  // gives its memory back
      next_ = 0;
      ++level_;
    }
    return level_;
  }
  // `level`: below the number of levels.
  void push(std::size_t level, std::uint32_t item) {
    buckets_[level < level_ ? level_ : level].push_back(item);
    ++count_;
  }
  [[nodiscard]] std::uint32_t pop() {
    const std::size_t at = level();
    --count_;
    return buckets_[at][next_++];
  }

 private:
  std::vector<std::vector<std::uint32_t>> buckets_;
  std::size_t level_ = 0, next_ = 0, count_ = 0;
};

// Weights of all HU, so that no voxel needs a division.
std::vector<std::uint8_t> weights_of(double threshold_hu) {
  std::vector<std::uint8_t> weights;
  for (int hu = std::numeric_limits<std::int16_t>::min(); hu <= std::numeric_limits<std::int16_t>::max(); ++hu) {
    const double part = hu < threshold_hu ? 1.0 : std::min((hu - threshold_hu) / kDenseAbove_hu, 1.0);
    weights.push_back(static_cast<std::uint8_t>(std::lround(1.0 + part * part * (kHeaviest - 1))));
  }
  return weights;
}

// Length of the step in each direction. Whole numbers, so that no depth depends on the order of a sum.
std::array<std::uint32_t, kDirections> lengths_of(const Vec3& spacing_mm, double unit_mm) {
  std::array<std::uint32_t, kDirections> lengths{};
  for (int direction = 0; direction < kDirections; ++direction) {
    const auto [x, y, z] = step_of(direction);
    const double length = Vec3(x, y, z).cwiseProduct(spacing_mm).norm() / unit_mm;
    lengths[static_cast<std::size_t>(direction)] =
        static_cast<std::uint32_t>(std::lround(std::min<double>(length, 2.0 * kDeepest)));
  }
  return lengths;
}

}  // namespace

Result<BoneDepth> bone_depth(const HuVolume& volume, const VoxelMask& mask, double threshold_hu,
                             const KeepGoing& keep_going) {
  if (volume.count() > std::numeric_limits<std::uint32_t>::max())
    return bad_input("a scan of " + describe(volume) +
                     " has too many voxels to separate its bones; export a smaller region");
  BoneDepth depth;
  depth.unit_mm = volume.spacing_mm.minCoeff() / kUnitsPerVoxel;
  depth.values = zeros<std::uint16_t>(volume.count());
  const std::vector<std::uint8_t> weights = weights_of(threshold_hu);
  const auto weight = [&](std::uint32_t voxel) -> std::uint32_t {
    return weights[static_cast<std::size_t>(volume.values[voxel] - std::numeric_limits<std::int16_t>::min())];
  };
  const std::array<std::uint32_t, kDirections> lengths = lengths_of(volume.spacing_mm, depth.unit_mm);
  const Neighbours neighbours(volume.dims);
  BucketQueue queue(std::size_t{kDeepest} + 1);

  // The surface lies half way to a voxel outside.
  const auto count = static_cast<std::uint32_t>(volume.count());
  std::uint32_t in_mask = 0;
  for (std::uint32_t voxel = 0; voxel < count; ++voxel) {
    if (voxel % kMeasuredAtOnce == 0 && !keep_going(0.2 * voxel / count))
      return stopped_while("measuring depths in the bone");
    if (mask.values[voxel] == 0) continue;
    ++in_mask;
    std::uint32_t least = kDeepest;
    neighbours.each(voxel, [&](std::uint32_t beside, int direction) {
      if (mask.values[beside] != 0) return;
      least = std::min(least, lengths[static_cast<std::size_t>(direction)] * weight(voxel) / (2 * kHeaviest));
    });
    depth.values[voxel] = static_cast<std::uint16_t>(std::max(1u, least));
    if (least < kDeepest) queue.push(depth.values[voxel], voxel);
  }

  std::uint32_t done = 0;
  for (std::uint32_t asked = 0; !queue.empty(); ++asked) {
    if (asked % kMeasuredAtOnce == 0 && !keep_going(0.2 + 0.8 * std::min(1.0, static_cast<double>(done) / in_mask)))
      return stopped_while("measuring depths in the bone");
    const auto level = static_cast<std::uint32_t>(queue.level());
    const std::uint32_t voxel = queue.pop();
    if (depth.values[voxel] != level) continue;  // a shorter path was found
    ++done;
    const std::uint32_t own = weight(voxel);
    neighbours.each(voxel, [&](std::uint32_t beside, int direction) {
      if (depth.values[beside] <= level) return;
      const std::uint32_t step = lengths[static_cast<std::size_t>(direction)] * (own + weight(beside));
      const std::uint32_t through = level + std::max(1u, step / (2 * kHeaviest));
      if (through >= depth.values[beside]) return;
      depth.values[beside] = static_cast<std::uint16_t>(through);
      queue.push(through, beside);
    });
  }
  return depth;
}

}  // namespace osteon::imaging
