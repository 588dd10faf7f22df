#include "viewer_client/imaging/kept_surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "common/surface/label_surface.hpp"
#include "viewer_client/imaging/reduced_scan.hpp"

namespace osteon {

namespace {

constexpr std::size_t kMostTriangles = 1'000'000;
constexpr std::int64_t kSolidPart = 4;  // a block is solid from this part of it on

// The voxels of each bone in the blocks of one slice of blocks.
class BoneCounts {
 public:
  BoneCounts(const ScanGeometry& scan, const ScanBlocks& blocks, const std::bitset<256>& bones)
      : sums_(scan, blocks), columns_(static_cast<std::size_t>(blocks.geometry.dims[0])), step_(blocks.step) {
    for (std::size_t bone = 1; bone < bones.size(); ++bone)
      if (bones.test(bone)) at_[bone] = bones_.size(), bones_.push_back(static_cast<std::uint8_t>(bone));
    counts_.resize(sums_.size() * bones_.size());
  }

  [[nodiscard]] BlockSums& slice() { return sums_; }
  void begin(int slice) {
    sums_.begin(slice);
    std::ranges::fill(counts_, 0);
  }
  void add(int row, std::span<const std::uint8_t> bones) {
    const std::size_t first = static_cast<std::size_t>(row / step_[1]) * columns_;
    for (std::size_t column = 0; column < bones.size(); ++column)
      if (bones[column] != 0)
        ++counts_[(first + column / static_cast<std::size_t>(step_[0])) * bones_.size() + at_[bones[column]]];
  }
  // 0: the block is not solid.
  [[nodiscard]] std::uint8_t bone(std::size_t block) const {
    const auto of_block = std::span(counts_).subspan(block * bones_.size(), bones_.size());
    const std::int64_t all = std::accumulate(of_block.begin(), of_block.end(), std::int64_t{0});
    if (all == 0 || kSolidPart * all < sums_.voxels(block)) return 0;
    return bones_[static_cast<std::size_t>(std::ranges::max_element(of_block) - of_block.begin())];
  }

 private:
  BlockSums sums_;
  std::size_t columns_;
  std::array<int, 3> step_;
  std::vector<std::uint8_t> bones_;
  std::array<std::size_t, 256> at_{};  // of each bone in `bones_`
  std::vector<std::int32_t> counts_;   // of each block, each bone
};

// The mean direction of the triangles round each point, by their area.
std::vector<std::array<float, 3>> normals_of(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> sums(mesh.positions_mm.size(), Eigen::Vector3f::Zero());
  const auto at = [&](std::uint32_t vertex) { return Eigen::Vector3f(mesh.positions_mm[vertex].data()); };
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f across = (at(b) - at(a)).cross(at(c) - at(a));
    for (const std::uint32_t vertex : {a, b, c}) sums[vertex] += across;
  }
  std::vector<std::array<float, 3>> normals;
  normals.reserve(sums.size());
  for (const Eigen::Vector3f& sum : sums) {
    const Eigen::Vector3f normal = sum.normalized();
    normals.push_back({normal.x(), normal.y(), normal.z()});
  }
  return normals;
}

// The bone of each block, columns fastest.
Result<VoxelFile<std::uint8_t>> bones_of_blocks(const ScanGeometry& scan, const ScanBlocks& blocks, KeptSlices& slices,
                                                const KeepGoing& keep_going) {
  BoneCounts counts(scan, blocks, slices.bones());
  VoxelFile<std::uint8_t> bones{blocks.geometry, {}};
  bones.values.reserve(blocks.geometry.count());
  const auto columns = static_cast<std::size_t>(scan.dims[0]);
  for (int block = 0; block < blocks.geometry.dims[2]; ++block) {
    counts.begin(block);
    for (int slice = counts.slice().first_slice(); slice < counts.slice().last_slice(); ++slice) {
      if (!keep_going(static_cast<double>(slice) / scan.dims[2]))
        return stopped_while("making the surface of the kept parts");
      const VoxelRange& range = slices.range();
      if (slice < range.first[2] || slice > range.last[2]) continue;
      const auto of_slice = slices.slice(slice);
      for (int row = range.first[1]; row <= range.last[1]; ++row)
        counts.add(row, of_slice.subspan(static_cast<std::size_t>(row) * columns, columns));
    }
    for (std::size_t i = 0; i < counts.slice().size(); ++i) bones.values.push_back(counts.bone(i));
  }
  return bones;
}

// The blocks round each bone.
std::array<VoxelRange, 256> ranges_of(const VoxelFile<std::uint8_t>& bones) {
  std::array<VoxelRange, 256> ranges;
  const auto [columns, rows, slices] = bones.geometry.dims;
  for (VoxelRange& range : ranges) range.first = bones.geometry.dims;
  for (int z = 0; z < slices; ++z)
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        const std::array<int, 3> at{x, y, z};
        VoxelRange& range = ranges[bones.at(at)];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          range.first[axis] = std::min(range.first[axis], at[axis]);
          range.last[axis] = std::max(range.last[axis], at[axis]);
        }
      }
  return ranges;
}

Result<TriangleMesh> surface_of(const VoxelFile<std::uint8_t>& bones, std::uint8_t bone, const VoxelRange& range,
                                std::size_t most_triangles) {
  VoxelGrid grid{
      {}, bones.geometry.position_mm(Vec3(range.first[0], range.first[1], range.first[2])), bones.geometry.axes_mm};
  for (std::size_t axis = 0; axis < 3; ++axis) grid.dims[axis] = range.last[axis] - range.first[axis] + 1;
  const auto read = [&](int slice, std::span<std::uint8_t> solid) {
    std::size_t i = 0;
    for (int row = 0; row < grid.dims[1]; ++row)
      for (int column = 0; column < grid.dims[0]; ++column)
        solid[i++] = bones.at({range.first[0] + column, range.first[1] + row, range.first[2] + slice}) == bone ? 1 : 0;
  };
  return label_surface(grid, read, most_triangles);
}

}  // namespace

Result<std::vector<KeptSurface>> kept_surfaces(const ScanGeometry& scan, const IslandMap& islands,
                                               const KeptParts& kept, const KeepGoing& keep_going) {
  KeptSlices slices(scan, islands, kept);
  std::vector<KeptSurface> surfaces;
  if (slices.bones().none()) return surfaces;
  const auto bones = bones_of_blocks(scan, blocks_of(scan), slices, keep_going);
  if (!bones) return tl::unexpected(bones.error());
  const std::array<VoxelRange, 256> ranges = ranges_of(*bones);
  std::size_t triangles = 0;
  for (std::size_t bone = 1; bone < ranges.size(); ++bone) {
    if (ranges[bone].last[0] < 0) continue;
    if (!keep_going(1.0)) return stopped_while("making the surface of the kept parts");
    auto surface = surface_of(*bones, static_cast<std::uint8_t>(bone), ranges[bone], kMostTriangles - triangles);
    if (!surface) return tl::unexpected(surface.error());
    triangles += surface->triangles.size();
    Mesh mesh;
    mesh.normals = normals_of(*surface);
    mesh.cut_face.assign(surface->positions_mm.size(), 0);
    mesh.positions_mm = std::move(surface->positions_mm);
    mesh.triangles = std::move(surface->triangles);
    surfaces.push_back({static_cast<int>(bone), std::move(mesh)});
  }
  return surfaces;
}

int island_near(const ScanGeometry& scan, const IslandMap& islands, const BonesOfIslands& bones, int bone,
                const std::array<int, 3>& voxel) {
  const std::array<int, 3> step = blocks_of(scan).step;
  int nearest = 0;
  double least_mm = std::numeric_limits<double>::infinity();
  for (int z = -step[2] - 1; z <= step[2] + 1; ++z)
    for (int y = -step[1] - 1; y <= step[1] + 1; ++y)
      for (int x = -step[0] - 1; x <= step[0] + 1; ++x) {
        const int island = islands.number({voxel[0] + x, voxel[1] + y, voxel[2] + z});
        if (island == 0 || shown_bone(bones[static_cast<std::size_t>(island)]) != bone) continue;
        const double distance_mm = (scan.axes_mm * Vec3(x, y, z)).norm();
        if (distance_mm < least_mm) least_mm = distance_mm, nearest = island;
      }
  if (nearest != 0) return nearest;
  for (std::size_t island = 1; island < bones.size(); ++island)
    if (shown_bone(bones[island]) == bone) return static_cast<int>(island);
  return 0;
}

std::optional<std::array<int, 3>> bone_voxel_near(const ScanGeometry& scan, const IslandMap& islands,
                                                  const KeptParts& kept, int bone, const std::array<int, 3>& voxel) {
  const std::array<int, 3> step = blocks_of(scan).step;
  KeptSlices slices(scan, islands, kept);
  const VoxelRange& range = slices.range();
  std::array<int, 3> first{}, last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = std::max(range.first[axis], voxel[axis] - step[axis] - 1);
    last[axis] = std::min(range.last[axis], voxel[axis] + step[axis] + 1);
  }
  std::optional<std::array<int, 3>> nearest;
  double least_mm = std::numeric_limits<double>::infinity();
  for (int z = first[2]; z <= last[2]; ++z) {
    const std::span<const std::uint8_t> slice = slices.slice(z);
    for (int y = first[1]; y <= last[1]; ++y)
      for (int x = first[0]; x <= last[0]; ++x) {
        if (slice[to_index(y) * to_index(scan.dims[0]) + to_index(x)] != bone) continue;
        const double distance_mm = (scan.axes_mm * Vec3(x - voxel[0], y - voxel[1], z - voxel[2])).norm();
        if (distance_mm < least_mm) least_mm = distance_mm, nearest = {x, y, z};
      }
  }
  return nearest;
}

std::vector<Vec3> painted_points(std::span<const SharedCorrection> corrections, double least_mm) {
  std::vector<Vec3> points;
  for (const SharedCorrection& stroke : corrections) {
    if (stroke->kind != CorrectionKind::paint) continue;
    const std::size_t before = points.size();
    for (const Vec3& point : stroke->points_mm)
      if (points.size() == before || (point - points.back()).norm() >= least_mm) points.push_back(point);
  }
  return points;
}

std::array<int, 3> voxel_near(const ScanGeometry& scan, const Vec3& at_mm) {
  const Vec3 at = scan.axes_mm.inverse() * (at_mm - scan.origin_mm);
  std::array<int, 3> voxel{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    voxel[a] = static_cast<int>(std::lround(std::clamp(at[axis], 0.0, scan.dims[a] - 1.0)));
  }
  return voxel;
}

}  // namespace osteon
