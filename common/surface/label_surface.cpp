#include "common/surface/label_surface.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/surface/marching_cubes.hpp"

namespace osteon {

namespace {

constexpr float kMostShift = 0.3f;  // of a point, in distances between two centres
constexpr int kRounds = 10;
constexpr float kForth = 0.5f, kBack = -0.53f;  // of the two halves of a round

// A point between a voxel and the next one along an axis; `along` from 0 to 1.
struct EdgePoint {
  std::array<std::int32_t, 3> voxel;
  std::uint8_t axis;
  float along;
};

Eigen::Vector3f in_voxels(const EdgePoint& point) {
  Eigen::Vector3f at(static_cast<float>(point.voxel[0]), static_cast<float>(point.voxel[1]),
                     static_cast<float>(point.voxel[2]));
  at[point.axis] += point.along;
  return at;
}

// Two neighbouring slices with a margin of one voxel, and the points on their edges.
class LabelContour {
 public:
  LabelContour(const VoxelGrid& grid, const ReadSlice& read) : grid_(grid), read_(read) {
    columns_ = to_index(grid.dims[0]) + 2;
    const std::size_t size = columns_ * (to_index(grid.dims[1]) + 2);
    for (auto& slice : slices_) slice.assign(size, 0);
    for (auto& axis : points_of_)
      for (auto& slice : axis) slice.assign(size, kNone);
    row_.resize(to_index(grid.dims[0]) * to_index(grid.dims[1]));
  }

  // False: too many triangles.
  bool build(std::size_t most_triangles) {
    for (int slice = -1; slice < grid_.dims[2]; ++slice) {
      next_slice(slice + 1);
      for (int row = -1; row < grid_.dims[1]; ++row)
        for (int column = -1; column < grid_.dims[0]; ++column) add_cell(column, row, slice);
      if (triangles_.size() > most_triangles) return false;
    }
    return true;
  }

  std::vector<EdgePoint> points_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  [[nodiscard]] std::size_t place(int column, int row) const {
    return to_index(row + 1) * columns_ + to_index(column + 1);
  }
  void next_slice(int slice) {
    std::swap(slices_[0], slices_[1]);
    std::ranges::fill(slices_[1], 0);
    for (auto& axis : points_of_) {
      std::swap(axis[0], axis[1]);
      std::ranges::fill(axis[1], kNone);
    }
    std::ranges::fill(points_of_[2][0], kNone);  // those along the slices' axis are between these two slices
    if (slice >= grid_.dims[2]) return;
    read_(slice, row_);
    for (int row = 0; row < grid_.dims[1]; ++row)
      std::copy_n(row_.begin() + static_cast<std::ptrdiff_t>(to_index(row) * to_index(grid_.dims[0])), grid_.dims[0],
                  slices_[1].begin() + static_cast<std::ptrdiff_t>(place(0, row)));
  }
  void add_cell(int column, int row, int slice) {
    const std::size_t here = place(column, row);
    unsigned corners = 0;
    for (unsigned i = 0; i < 8; ++i)
      if (slices_[i & 1][here + (i >> 1 & 1) * columns_ + (i >> 2 & 1)] != 0) corners |= 1u << i;
    if (corners == 0 || corners == 255) return;
    const MarchingCubesTable& table = marching_cubes_table();
    const CellCase& found = table.cases[corners];
    std::array<std::uint32_t, 3> triangle{};
    for (unsigned i = 0; i < found.corners; ++i) {
      const CellEdge& edge = table.edges[found.edges[i]];
      const int x = edge.corner >> 2 & 1, y = edge.corner >> 1 & 1, z = edge.corner & 1;
      std::uint32_t& number = points_of_[edge.axis][to_index(z)][place(column + x, row + y)];
      if (number == kNone) {
        number = static_cast<std::uint32_t>(points_.size());
        points_.push_back({{column + x, row + y, slice + z}, edge.axis, 0.5f});
      }
      triangle[i % 3] = number;
      if (i % 3 == 2) triangles_.push_back(triangle);
    }
  }

  const VoxelGrid& grid_;
  const ReadSlice& read_;
  std::size_t columns_ = 0;
  std::array<std::vector<std::uint8_t>, 2> slices_;
  std::array<std::array<std::vector<std::uint32_t>, 2>, 3> points_of_;  // by axis and slice
  std::vector<std::uint8_t> row_;
};

void smooth(std::vector<EdgePoint>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<Eigen::Vector3f> sums(points.size());
  std::vector<float> counts(points.size());
  for (int half = 0; half < 2 * kRounds; ++half) {
    std::ranges::fill(sums, Eigen::Vector3f::Zero());
    std::ranges::fill(counts, 0.0f);
    for (const auto& triangle : triangles)
      for (std::size_t i = 0; i < 3; ++i) {
        // Each neighbour comes from two triangles.
        sums[triangle[i]] += in_voxels(points[triangle[(i + 1) % 3]]) + in_voxels(points[triangle[(i + 2) % 3]]);
        counts[triangle[i]] += 2.0f;
      }
    for (std::size_t i = 0; i < points.size(); ++i) {
      EdgePoint& point = points[i];
      const float mean = sums[i][point.axis] / counts[i] - static_cast<float>(point.voxel[point.axis]);
      const float moved = point.along + (half % 2 == 0 ? kForth : kBack) * (mean - point.along);
      point.along = std::clamp(moved, 0.5f - kMostShift, 0.5f + kMostShift);
    }
  }
}

}  // namespace

Result<TriangleMesh> label_surface(const VoxelGrid& grid, const ReadSlice& read, std::size_t most_triangles) {
  LabelContour contour(grid, read);
  if (!contour.build(most_triangles))
    return failure(ErrorCode::exhausted,
                   "the surface of a label has more than " + std::to_string(most_triangles) + " triangles");
  smooth(contour.points_, contour.triangles_);
  TriangleMesh mesh;
  mesh.positions_mm.reserve(contour.points_.size());
  for (const EdgePoint& point : contour.points_) {
    const Vec3 at = grid.origin_mm + grid.axes_mm * in_voxels(point).cast<double>();
    mesh.positions_mm.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z())});
  }
  mesh.triangles = std::move(contour.triangles_);
  if (grid.axes_mm.determinant() < 0.0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

}  // namespace osteon
