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

// The plane of each slice along the voxels, so that its pixels lie as the voxels do.
PlaneAxes along_voxels(const ScanGeometry& scan) {
  PlaneAxes axes;
  axes.columns = scan.dims[0];
  axes.rows = scan.dims[1];
  axes.slices = scan.dims[2];
  return axes;
}

// Which voxels are kept, slice by slice.
class KeptSlices {
 public:
  KeptSlices(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept)
      : scan_(scan),
        islands_(islands),
        kept_(kept),
        axes_(along_voxels(scan)),
        range_(range_of(scan, kept.box)),
        row_(static_cast<std::size_t>(scan.dims[0])) {
    for (std::size_t island = 1; island < kept.bones.size(); ++island) grows_.set(island, kept.bones[island].any());
  }

  // Whether there may be such a voxel.
  [[nodiscard]] bool any() const { return grows_.any() || !kept_.corrections.empty(); }
  void add_to(BlockSums& sums, int slice) {
    if (slice < range_.first[2] || slice > range_.last[2]) return;
    const auto marks = corrected_plane(scan_, islands_, kept_.bones, axes_, slice, kept_.corrections);
    for (int row = range_.first[1]; row <= range_.last[1]; ++row) {
      std::ranges::fill(row_, std::uint8_t{0});
      const std::size_t first = static_cast<std::size_t>(row) * row_.size();
      for (int column = range_.first[0]; column <= range_.last[0]; ++column) {
        const auto at = static_cast<std::size_t>(column);
        const std::uint8_t mark = marks.empty() ? std::uint8_t{0} : marks[first + at];
        row_[at] = mark == 0 ? grows_.test(islands_.number({column, row, slice})) : mark != kErased;
      }
      sums.add(row, std::span<const std::uint8_t>(row_));
    }
  }

 private:
  const ScanGeometry& scan_;
  const IslandMap& islands_;
  const KeptParts& kept_;
  PlaneAxes axes_;
  VoxelRange range_;
  std::bitset<256> grows_;  // the islands in which a bone grows
  std::vector<std::uint8_t> row_;
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

}  // namespace

Result<Mesh> kept_surface(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                          const KeepGoing& keep_going) {
  const ScanBlocks blocks = blocks_of(scan);
  BlockSums sums(scan, blocks);
  KeptSlices slices(scan, islands, kept);
  if (!slices.any()) return Mesh();
  bool stopped = false;
  const auto read = [&](int block, std::span<std::uint8_t> solid) {
    sums.begin(block);
    for (int slice = sums.first_slice(); slice < sums.last_slice() && !stopped; ++slice) {
      stopped = !keep_going(static_cast<double>(slice) / scan.dims[2]);
      if (!stopped) slices.add_to(sums, slice);
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
