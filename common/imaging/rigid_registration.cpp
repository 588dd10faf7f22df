#include "common/imaging/rigid_registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <random>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/imaging/mutual_information.hpp"
#include "common/imaging/threshold.hpp"

namespace osteon::imaging {
namespace {

constexpr const char* kTask = "registering the scans";
constexpr std::array<int, 4> kCoarseness{8, 4, 2, 1};  // voxels of each level, in those of the finest one
constexpr double kMostVoxels = 8e6;                    // of a scan on the finest level
constexpr std::size_t kLeastVoxels = 4000;             // of a scan on a level that is worth a search
constexpr int kShortestAxis = 8;                       // voxels that a level leaves along an axis
constexpr std::size_t kMostPoints = 40'000;            // where values are compared
constexpr std::size_t kMostIterations = 200;           // on each level
constexpr std::uint_fast32_t kSeed = 2003;
// Values beyond these parts of a scan's voxels count as the last one within: a few voxels of metal would leave all
// tissue in a few bins.
constexpr double kTail = 1e-4;
// Of a scan's diagonal: the usual distance of bone from the middle. With a larger one the search would shorten its
// steps before it has turned the scan far enough.
constexpr double kRadiusShare = 0.125;
constexpr int kOverlapSteps = 24;     // along each axis of the fixed scan
constexpr double kLostOverlap = 0.5;  // of that at the start: less means that the search went astray
constexpr double kEqualShare = 0.01;  // starts whose information differs by less are equal

// The values that count.
struct Range {
  std::int16_t low = 0, high = 0;
};

Result<Range> range_of(const HuVolume& scan, const char* which, const KeepGoing& keep_going) {
  const auto histogram = hu_histogram(scan, keep_going);
  if (!histogram) return tl::unexpected(histogram.error());
  const auto beyond = static_cast<std::int64_t>(kTail * static_cast<double>(scan.count()));
  std::size_t low = 0, high = histogram->size() - 1;
  for (std::int64_t n = 0; low < high && (n += (*histogram)[low]) <= beyond;) ++low;
  for (std::int64_t n = 0; high > low && (n += (*histogram)[high]) <= beyond;) --high;
  if (low == high)
    return bad_input(std::string("nearly all voxels of the ") + which +
                     " scan have one value; give a scan that shows the bone");
  return Range{static_cast<std::int16_t>(static_cast<int>(low) + kLeastHu),
               static_cast<std::int16_t>(static_cast<int>(high) + kLeastHu)};
}

// A scan with larger voxels, each the mean of some of the scan's.
struct Level {
  HuVolume grid;  // without values
  std::vector<float> values;
};

std::array<int, 3> factors_for(const HuVolume& scan, double voxel_mm) {
  std::array<int, 3> factors{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    factors[axis] = std::clamp(static_cast<int>(std::lround(voxel_mm / scan.spacing_mm[static_cast<int>(axis)])), 1,
                               std::max(1, scan.dims[axis] / kShortestAxis));
  return factors;
}

std::size_t voxels_with(const HuVolume& scan, const std::array<int, 3>& factors) {
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) count *= static_cast<std::size_t>(scan.dims[axis] / factors[axis]);
  return count;
}

Result<Level> coarse(const HuVolume& scan, const std::array<int, 3>& factors, const Range& range,
                     const KeepGoing& keep_going) {
  Level level;
  HuVolume& grid = level.grid;
  Vec3 first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<int>(axis);
    grid.dims[axis] = scan.dims[axis] / factors[axis];
    grid.spacing_mm[i] = scan.spacing_mm[i] * factors[axis];
    first[i] = 0.5 * (factors[axis] - 1);
  }
  grid.origin_mm = scan.position_mm(first);
  grid.directions = scan.directions;
  level.values.assign(grid.count(), 0.0f);
  const auto share = 1.0f / static_cast<float>(factors[0] * factors[1] * factors[2]);
  for (int slice = 0; slice < grid.dims[2] * factors[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / scan.dims[2])) return stopped_while(kTask);
    for (int row = 0; row < grid.dims[1] * factors[1]; ++row) {
      const std::int16_t* from = scan.values.data() + scan.index(0, row, slice);
      float* to = level.values.data() + grid.index(0, row / factors[1], slice / factors[2]);
      for (int column = 0; column < grid.dims[0]; ++column)
        for (int i = 0; i < factors[0]; ++i)
          to[column] += share * static_cast<float>(std::clamp(*from++, range.low, range.high));
    }
  }
  return level;
}

// The level on the same memory, moved by `pose`.
GreyImage image_of(Level& level, const Pose& pose) {
  GreyImage image{
      .dims = level.grid.dims, .spacing_mm = {}, .origin_mm = {}, .axes = {}, .values = level.values.data()};
  const Vec3 origin_mm = pose.point(level.grid.origin_mm);
  const Eigen::Matrix3d axes = pose.rotation.toRotationMatrix() * level.grid.directions;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    image.spacing_mm[i] = level.grid.spacing_mm[axis];
    image.origin_mm[i] = origin_mm[axis];
    for (int row = 0; row < 3; ++row) image.axes[i][static_cast<std::size_t>(row)] = axes(row, axis);
  }
  return image;
}

// Points all over a scan, each at random within a voxel: at the voxels' centres no value would be interpolated, and
// poses that put voxel on voxel would seem better than others.
std::vector<std::array<float, 3>> sample_points(const HuVolume& grid) {
  std::vector<std::array<float, 3>> points;
  std::mt19937 random(kSeed);
  const auto within = [&random] { return static_cast<double>(random()) * 0x1p-32 - 0.5; };
  const std::size_t count = grid.count(), most = std::min(count, kMostPoints);
  const auto columns = static_cast<std::size_t>(grid.dims[0]), rows = static_cast<std::size_t>(grid.dims[1]);
  for (std::size_t i = 0; i < most; ++i) {
    const std::size_t voxel = i * count / most;
    Vec3 at(static_cast<double>(voxel % columns), static_cast<double>(voxel / columns % rows),
            static_cast<double>(voxel / columns / rows));
    for (int axis = 0; axis < 3; ++axis) at[axis] += within();
    const Eigen::Vector3f position_mm = grid.position_mm(at).cast<float>();
    points.push_back({position_mm.x(), position_mm.y(), position_mm.z()});
  }
  return points;
}

Vec3 centre_of(const HuVolume& grid) {
  return grid.position_mm(0.5 * Vec3(grid.dims[0] - 1, grid.dims[1] - 1, grid.dims[2] - 1));
}

double diagonal_mm(const HuVolume& grid) {
  return grid.spacing_mm.cwiseProduct(Vec3(grid.dims[0], grid.dims[1], grid.dims[2])).norm();
}

// One level of both scans.
struct LevelPair {
  Level fixed, moving;
  std::vector<std::array<float, 3>> points_mm;  // of the fixed one
};

// Between the fixed scan and the moving one at `pose`.
Result<MutualInformation> information_of(LevelPair& level, const Pose& pose) {
  const Vec3 centre = centre_of(level.fixed.grid);
  return MutualInformation::between(image_of(level.fixed, Pose{}), image_of(level.moving, pose), level.points_mm,
                                    {centre.x(), centre.y(), centre.z()});
}

Result<double> information_at(LevelPair& level, const Pose& pose) {
  if (overlap_of(level.fixed.grid, level.moving.grid, pose) < kLeastOverlap) return 0.0;
  const auto information = information_of(level, pose);
  if (!information) return tl::unexpected(information.error());
  return information->value();
}

// The moving scan seen from the fixed one after a search that began at `pose` and found how the fixed scan moves.
Pose pose_after(const RigidMotion& found, const Pose& pose) {
  Eigen::Matrix3d rotation;
  Vec3 offset_mm;
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<std::size_t>(row);
    offset_mm[row] = found.offset_mm[r];
    for (int column = 0; column < 3; ++column)
      rotation(row, column) = found.rotation[r][static_cast<std::size_t>(column)];
  }
  return Pose{offset_mm, Eigen::Quaterniond(rotation).normalized()}.inverse() * pose;
}

// Goes uphill from `pose` on one level. A search that fails, because it left the moving scan, ends where it began.
Result<Pose> refined(LevelPair& level, const Pose& pose, const KeepGoing& keep_going) {
  auto information = information_of(level, pose);
  if (!information) return tl::unexpected(information.error());
  const auto found = information->search(level.fixed.grid.spacing_mm.minCoeff(),
                                         kRadiusShare * diagonal_mm(level.fixed.grid), kMostIterations, keep_going);
  if (found) return pose_after(*found, pose);
  if (found.error().code == ErrorCode::internal) return pose;
  return tl::unexpected(found.error());
}

// The start that has the most information after a search on this level, and its pose there.
struct Chosen {
  std::size_t start = 0;
  Pose pose;
};

Result<Chosen> choose(LevelPair& level, std::span<const Pose> starts, const KeepGoing& keep_going) {
  Chosen best;
  double most = -1.0, widest = 0.0;
  for (const Pose& start : starts) widest = std::max(widest, overlap_of(level.fixed.grid, level.moving.grid, start));
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const double count = static_cast<double>(starts.size());
    const KeepGoing going = part(keep_going, static_cast<double>(i) / count, static_cast<double>(i + 1) / count);
    if (overlap_of(level.fixed.grid, level.moving.grid, starts[i]) < std::max(kLeastOverlap, kLostOverlap * widest))
      continue;
    const auto pose = refined(level, starts[i], going);
    if (!pose) return tl::unexpected(pose.error());
    if (overlap_of(level.fixed.grid, level.moving.grid, *pose) < kLostOverlap * widest && most >= 0.0) continue;
    const auto information = information_at(level, *pose);
    if (!information) return tl::unexpected(information.error());
    if (*information <= most * (1.0 + kEqualShare) && most >= 0.0) continue;
    most = *information;
    best = {i, *pose};
  }
  return best;
}

// The sizes of voxels for the search, from coarse to fine, mm.
std::vector<double> voxel_sizes(const HuVolume& fixed, const HuVolume& moving) {
  double finest_mm = std::max(fixed.spacing_mm.minCoeff(), moving.spacing_mm.minCoeff());
  const auto voxels = [&](double voxel_mm) {
    return std::pair(voxels_with(fixed, factors_for(fixed, voxel_mm)),
                     voxels_with(moving, factors_for(moving, voxel_mm)));
  };
  for (int i = 0; i < 16; ++i) {
    const auto [a, b] = voxels(finest_mm);
    if (static_cast<double>(std::max(a, b)) <= kMostVoxels) break;
    finest_mm *= 1.25;
  }
  std::vector<double> sizes;
  for (const int coarseness : kCoarseness) {
    const auto [a, b] = voxels(coarseness * finest_mm);
    if (coarseness == 1 || std::min(a, b) >= kLeastVoxels) sizes.push_back(coarseness * finest_mm);
  }
  return sizes;
}

Result<LevelPair> level_of(const HuVolume& fixed, const HuVolume& moving, const Range& fixed_range,
                           const Range& moving_range, double voxel_mm, const KeepGoing& keep_going) {
  LevelPair level;
  auto made = coarse(fixed, factors_for(fixed, voxel_mm), fixed_range, part(keep_going, 0.0, 0.5));
  if (!made) return tl::unexpected(made.error());
  level.fixed = std::move(*made);
  made = coarse(moving, factors_for(moving, voxel_mm), moving_range, part(keep_going, 0.5, 1.0));
  if (!made) return tl::unexpected(made.error());
  level.moving = std::move(*made);
  level.points_mm = sample_points(level.fixed.grid);
  return level;
}

// Keeps the start if the search found nothing better on the finest level.
Result<void> judge(LevelPair& finest, const Pose& start, RigidRegistration& found) {
  const auto at_start = information_at(finest, start);
  if (!at_start) return tl::unexpected(at_start.error());
  const auto at_result = information_at(finest, found.pose_fixed_moving);
  if (!at_result) return tl::unexpected(at_result.error());
  found.information_at_start = *at_start;
  found.information = *at_result;
  found.overlap_at_start = overlap_of(finest.fixed.grid, finest.moving.grid, start);
  found.overlap = overlap_of(finest.fixed.grid, finest.moving.grid, found.pose_fixed_moving);
  if (found.information > found.information_at_start && found.overlap >= kLostOverlap * found.overlap_at_start)
    return {};
  found.refined = false;
  found.pose_fixed_moving = start;
  found.information = found.information_at_start;
  found.overlap = found.overlap_at_start;
  return {};
}

Result<RigidRegistration> search(const HuVolume& fixed, const HuVolume& moving, std::span<const Pose> starts,
                                 const KeepGoing& keep_going) {
  const auto fixed_range = range_of(fixed, "fixed", part(keep_going, 0.0, 0.05));
  if (!fixed_range) return tl::unexpected(fixed_range.error());
  const auto moving_range = range_of(moving, "moving", part(keep_going, 0.05, 0.1));
  if (!moving_range) return tl::unexpected(moving_range.error());
  RigidRegistration found;
  const std::vector<double> sizes = voxel_sizes(fixed, moving);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double begin = 0.1 + 0.9 * static_cast<double>(i) / static_cast<double>(sizes.size());
    const double end = 0.1 + 0.9 * static_cast<double>(i + 1) / static_cast<double>(sizes.size());
    const double searched_from = begin + 0.2 * (end - begin);
    auto level = level_of(fixed, moving, *fixed_range, *moving_range, sizes[i], part(keep_going, begin, searched_from));
    if (!level) return tl::unexpected(level.error());
    const KeepGoing searching = part(keep_going, searched_from, end);
    if (i == 0) {
      const auto chosen = choose(*level, starts, searching);
      if (!chosen) return tl::unexpected(chosen.error());
      found.start = chosen->start;
      found.pose_fixed_moving = chosen->pose;
    } else {
      const auto pose = refined(*level, found.pose_fixed_moving, searching);
      if (!pose) return tl::unexpected(pose.error());
      found.pose_fixed_moving = *pose;
    }
    if (i + 1 < sizes.size()) continue;
    if (auto judged = judge(*level, starts[found.start], found); !judged) return tl::unexpected(judged.error());
  }
  if (!keep_going(1.0)) return stopped_while(kTask);
  return found;
}

}  // namespace

double overlap_of(const HuVolume& fixed, const HuVolume& moving, const Pose& pose_fixed_moving) {
  const Pose pose_moving_fixed = pose_fixed_moving.inverse();
  const Vec3 size(fixed.dims[0], fixed.dims[1], fixed.dims[2]);
  int within = 0;
  for (int i = 0; i < kOverlapSteps; ++i)
    for (int j = 0; j < kOverlapSteps; ++j)
      for (int k = 0; k < kOverlapSteps; ++k) {
        const Vec3 voxel = size.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5)) / kOverlapSteps - Vec3::Constant(0.5);
        if (outside_scan_mm(moving, pose_moving_fixed.point(fixed.position_mm(voxel))) <= 0.0) ++within;
      }
  const auto mm3 = [](const HuVolume& scan) { return static_cast<double>(scan.count()) * scan.spacing_mm.prod(); };
  const double shared_mm3 = mm3(fixed) * within / (kOverlapSteps * kOverlapSteps * kOverlapSteps);
  return std::min(1.0, shared_mm3 / std::min(mm3(fixed), mm3(moving)));
}

Result<RigidRegistration> register_rigidly(const HuVolume& fixed, const HuVolume& moving, std::span<const Pose> starts,
                                           const KeepGoing& keep_going) try {
  OSTEON_CHECK(!starts.empty());
  if (std::ranges::none_of(starts,
                           [&](const Pose& start) { return overlap_of(fixed, moving, start) >= kLeastOverlap; }))
    return bad_input("the scans overlap by less than 5 % at the start; give landmarks of what both scans show");
  return search(fixed, moving, starts, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory to register the scans; export smaller regions");
}

}  // namespace osteon::imaging
