#include "viewer_client/imaging/kept_surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "common/surface/label_surface.hpp"
#include "viewer_client/imaging/reduced_scan.hpp"

namespace osteon {

namespace {

constexpr std::size_t kMostTriangles = 1'000'000;
constexpr std::int64_t kSolidPart = 4;  // a block is solid from this part of it on

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

}  // namespace

Result<Mesh> kept_surface(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                          const KeepGoing& keep_going) {
  const ScanBlocks blocks = blocks_of(scan);
  BlockSums sums(scan, blocks);
  KeptSlices slices(scan, islands, kept);
  if (!slices.any()) return Mesh();
  bool stopped = false;
  const auto columns = static_cast<std::size_t>(scan.dims[0]);
  const auto read = [&](int block, std::span<std::uint8_t> solid) {
    sums.begin(block);
    for (int slice = sums.first_slice(); slice < sums.last_slice() && !stopped; ++slice) {
      stopped = !keep_going(static_cast<double>(slice) / scan.dims[2]);
      const VoxelRange& range = slices.range();
      if (stopped || slice < range.first[2] || slice > range.last[2]) continue;
      const auto voxels = slices.slice(slice);
      for (int row = range.first[1]; row <= range.last[1]; ++row)
        sums.add(row, voxels.subspan(static_cast<std::size_t>(row) * columns, columns));
    }
    for (std::size_t i = 0; i < solid.size(); ++i)
      solid[i] = !stopped && sums.sum(i) > 0 && kSolidPart * sums.sum(i) >= sums.voxels(i);
  };
  auto surface =
      label_surface({blocks.geometry.dims, blocks.geometry.origin_mm, blocks.geometry.axes_mm}, read, kMostTriangles);
  if (stopped) return stopped_while("making the surface of the kept parts");
  if (!surface) return tl::unexpected(surface.error());
  Mesh mesh;
  mesh.normals = normals_of(*surface);
  mesh.cut_face.assign(surface->positions_mm.size(), 0);
  mesh.positions_mm = std::move(surface->positions_mm);
  mesh.triangles = std::move(surface->triangles);
  return mesh;
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
