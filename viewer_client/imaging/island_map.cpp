#include "viewer_client/imaging/island_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace osteon {

namespace {

constexpr double kSameVoxel = 1e-3;  // of a step

Vec3 voxels_at(const ScanGeometry& scan, const Vec3& at_mm) {
  return scan.axes_mm.inverse() * (at_mm - scan.origin_mm);
}

}  // namespace

std::optional<std::array<int, 3>> voxel_of(const ScanGeometry& scan, const Vec3& at_mm) {
  const Vec3 at = voxels_at(scan, at_mm);
  std::array<int, 3> voxel{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (!(at[axis] >= -0.5) || !(at[axis] < scan.dims[a] - 0.5)) return {};
    voxel[a] = static_cast<int>(std::floor(at[axis] + 0.5));
  }
  return voxel;
}

Vec3 centre_of(const ScanGeometry& scan, const std::array<int, 3>& voxel) {
  return scan.position_mm(Vec3(voxel[0], voxel[1], voxel[2]));
}

Result<IslandMap> IslandMap::make(const ScanGeometry& scan, VoxelFile<std::uint8_t> numbers) {
  IslandMap map;
  const Vec3 at = voxels_at(scan, numbers.geometry.origin_mm);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    map.first_[a] = static_cast<int>(std::lround(at[axis]));
    if (std::abs(at[axis] - map.first_[a]) > kSameVoxel || map.first_[a] < 0 ||
        map.first_[a] + numbers.geometry.dims[a] > scan.dims[a] ||
        (scan.axes_mm.col(axis) - numbers.geometry.axes_mm.col(axis)).norm() >
            kSameVoxel * scan.axes_mm.col(axis).norm())
      return bad_input("the islands lie on other voxels than the scan; open the CT again");
  }
  map.numbers_ = std::move(numbers);
  return map;
}

std::optional<std::array<int, 3>> IslandMap::seed_near(const ShownScan& scan, int island, double threshold_hu,
                                                       const std::array<int, 3>& voxel) const {
  std::optional<std::array<int, 3>> nearest;
  double least_mm2 = std::numeric_limits<double>::infinity();
  const Vec3 step_mm = scan.geometry.axes_mm.colwise().norm();
  const auto [columns, rows, slices] = numbers_.geometry.dims;
  std::size_t n = 0;
  for (int k = 0; k < slices; ++k)
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i, ++n) {
        if (numbers_.values[n] != island) continue;
        const std::array<int, 3> at{i + first_[0], j + first_[1], k + first_[2]};
        const Vec3 way(at[0] - voxel[0], at[1] - voxel[1], at[2] - voxel[2]);
        const double mm2 = way.cwiseProduct(step_mm).squaredNorm();
        if (mm2 >= least_mm2 || scan.at(at) < threshold_hu) continue;
        least_mm2 = mm2;
        nearest = at;
      }
  return nearest;
}

std::vector<bool> IslandMap::growing(const ShownScan& scan, int island, double threshold_hu) const {
  std::vector<bool> may(numbers_.values.size());
  for (std::size_t n = 0; n < may.size(); ++n)
    may[n] = numbers_.values[n] == island && !(scan.at(in_scan(n)) < threshold_hu);
  return may;
}

std::array<int, 3> IslandMap::in_scan(std::size_t index) const {
  const auto columns = static_cast<std::size_t>(numbers_.geometry.dims[0]);
  const auto rows = static_cast<std::size_t>(numbers_.geometry.dims[1]);
  return {static_cast<int>(index % columns) + first_[0], static_cast<int>(index / columns % rows) + first_[1],
          static_cast<int>(index / columns / rows) + first_[2]};
}

std::optional<std::array<int, 3>> IslandMap::main_seed_near(const ShownScan& scan, int island, double threshold_hu,
                                                            const std::array<int, 3>& voxel) const {
  std::vector<bool> left = growing(scan, island, threshold_hu);  // and in no piece so far
  const auto& dims = numbers_.geometry.dims;
  const std::array<std::size_t, 3> step{1, static_cast<std::size_t>(dims[0]),
                                        static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1])};
  std::vector<std::size_t> largest, piece;
  for (std::size_t n = 0; n < left.size(); ++n) {
    if (!left[n]) continue;
    piece.assign(1, n);
    left[n] = false;
    const auto take = [&](std::size_t index) {
      if (!left[index]) return;
      left[index] = false;
      piece.push_back(index);
    };
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const std::size_t from = piece[next];
      const std::array<int, 3> at = in_scan(from);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (at[axis] > first_[axis]) take(from - step[axis]);
        if (at[axis] + 1 < first_[axis] + dims[axis]) take(from + step[axis]);
      }
    }
    if (piece.size() > largest.size()) largest.swap(piece);
  }
  if (largest.empty()) return {};
  const Vec3 step_mm = scan.geometry.axes_mm.colwise().norm();
  const auto far_mm2 = [&](std::size_t index) {
    const std::array<int, 3> at = in_scan(index);
    return Vec3(at[0] - voxel[0], at[1] - voxel[1], at[2] - voxel[2]).cwiseProduct(step_mm).squaredNorm();
  };
  return in_scan(*std::ranges::min_element(largest, {}, far_mm2));
}

std::vector<Vec3> IslandMap::moved_seeds(const ShownScan& scan, double threshold_hu,
                                         std::span<const Vec3> seeds_mm) const {
  std::vector<Vec3> moved;
  for (const Vec3& seed : seeds_mm) {
    auto voxel = voxel_of(scan.geometry, seed);
    const int island = voxel ? number(*voxel) : 0;
    if (island == 0) continue;
    if (scan.at(*voxel) < threshold_hu) voxel = seed_near(scan, island, threshold_hu, *voxel);
    if (!voxel) continue;
    const Vec3 at_mm = centre_of(scan.geometry, *voxel);
    if (std::ranges::find(moved, at_mm) == moved.end()) moved.push_back(at_mm);
  }
  return moved;
}

}  // namespace osteon
