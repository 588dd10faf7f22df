#include "viewer_client/imaging/plane_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace osteon {

namespace {

// For each axis of the patient (left, back, head) the axis of the voxels that is nearest to it, each only once.
std::array<int, 3> nearest_axes(const ScanGeometry& geometry) {
  const Eigen::Matrix3d directions = geometry.axes_mm.colwise().normalized();
  std::array<int, 3> order{0, 1, 2}, best = order;
  double most = -1.0;
  do {
    double sum = 0.0;
    for (int side = 0; side < 3; ++side) sum += std::abs(directions(side, order[static_cast<std::size_t>(side)]));
    if (sum > most) most = sum, best = order;
  } while (std::ranges::next_permutation(order).found);
  return best;
}

// The side of the patient to which a plane's columns, rows and slices go: 0 left, 1 back, 2 head. Rows of planes that
// are seen from the front or the side go to the foot.
struct PlaneSides {
  std::size_t right, down, through;
  double down_sign;
};
PlaneSides sides_of(Plane plane) {
  switch (plane) {
    case Plane::coronal:
      return {0, 2, 1, -1.0};
    case Plane::sagittal:
      return {1, 2, 0, -1.0};
    default:
      return {0, 1, 2, 1.0};
  }
}

int turned(int index, int count, bool flip) { return flip ? count - 1 - index : index; }

}  // namespace

PlaneAxes axes_of(const ScanGeometry& geometry, Plane plane) {
  const std::array<int, 3> nearest = nearest_axes(geometry);
  const PlaneSides sides = sides_of(plane);
  PlaneAxes axes;
  axes.right = nearest[sides.right];
  axes.down = nearest[sides.down];
  axes.through = nearest[sides.through];
  axes.flip_right = geometry.axes_mm(static_cast<int>(sides.right), axes.right) < 0.0;
  axes.flip_down = sides.down_sign * geometry.axes_mm(static_cast<int>(sides.down), axes.down) < 0.0;
  axes.flip_through = geometry.axes_mm(static_cast<int>(sides.through), axes.through) < 0.0;
  axes.right_mm = geometry.axes_mm.col(axes.right).norm();
  axes.down_mm = geometry.axes_mm.col(axes.down).norm();
  axes.columns = geometry.dims[static_cast<std::size_t>(axes.right)];
  axes.rows = geometry.dims[static_cast<std::size_t>(axes.down)];
  axes.slices = geometry.dims[static_cast<std::size_t>(axes.through)];
  return axes;
}

EdgeLetters letters_of(const PlaneAxes& axes, const ScanGeometry& geometry) {
  const Vec3 right = geometry.axes_mm.col(axes.right), down = geometry.axes_mm.col(axes.down);
  return edge_letters(axes.flip_right ? Vec3(-right) : right, axes.flip_down ? Vec3(-down) : down);
}

std::array<int, 3> voxel_at(const PlaneAxes& axes, int column, int row, int slice) {
  std::array<int, 3> voxel{};
  voxel[static_cast<std::size_t>(axes.right)] = turned(column, axes.columns, axes.flip_right);
  voxel[static_cast<std::size_t>(axes.down)] = turned(row, axes.rows, axes.flip_down);
  voxel[static_cast<std::size_t>(axes.through)] = turned(slice, axes.slices, axes.flip_through);
  return voxel;
}

std::array<int, 3> place_in(const PlaneAxes& axes, const std::array<int, 3>& voxel) {
  return {turned(voxel[static_cast<std::size_t>(axes.right)], axes.columns, axes.flip_right),
          turned(voxel[static_cast<std::size_t>(axes.down)], axes.rows, axes.flip_down),
          turned(voxel[static_cast<std::size_t>(axes.through)], axes.slices, axes.flip_through)};
}

PlaneFrame fit(const PlaneAxes& axes, double width_px, double height_px) {
  const double width_mm = axes.columns * axes.right_mm, height_mm = axes.rows * axes.down_mm;
  const double scale = std::max(0.0, std::min(width_px / width_mm, height_px / height_mm));
  const double width = scale * width_mm, height = scale * height_mm;
  return {0.5 * (width_px - width), 0.5 * (height_px - height), width, height};
}

std::array<int, 2> under(const PlaneAxes& axes, const PlaneFrame& frame, double x_px, double y_px) {
  const auto nearest = [](double part, int count) {
    return std::clamp(static_cast<int>(std::floor(part * count)), 0, count - 1);
  };
  if (!(frame.width_px > 0.0) || !(frame.height_px > 0.0)) return {0, 0};
  return {nearest((x_px - frame.left_px) / frame.width_px, axes.columns),
          nearest((y_px - frame.top_px) / frame.height_px, axes.rows)};
}

std::array<double, 2> pixel_of(const PlaneAxes& axes, const PlaneFrame& frame, int column, int row) {
  return {frame.left_px + frame.width_px * (column + 0.5) / axes.columns,
          frame.top_px + frame.height_px * (row + 0.5) / axes.rows};
}

}  // namespace osteon
