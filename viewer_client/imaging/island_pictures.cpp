#include "viewer_client/imaging/island_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "viewer_client/imaging/plane_view.hpp"

namespace osteon {

namespace {

constexpr std::size_t kNumbers = 256;
constexpr double kFarthestGrey = 90.0, kNearestGrey = 255.0;
constexpr double kSamePixel = 1e-6;  // rounding

// Column, row and slice of the coronal plane.
struct Extent {
  std::array<int, 3> first{std::numeric_limits<int>::max(), std::numeric_limits<int>::max(),
                           std::numeric_limits<int>::max()},
      last{-1, -1, -1};

  void include(const std::array<int, 3>& place) {
    for (std::size_t i = 0; i < place.size(); ++i) {
      first[i] = std::min(first[i], place[i]);
      last[i] = std::max(last[i], place[i]);
    }
  }
};

template <class Visit>
void each_island_voxel(const VoxelFile<std::uint8_t>& numbers, const PlaneAxes& axes, Visit visit) {
  const auto& dims = numbers.geometry.dims;
  std::size_t at = 0;
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x)
        if (const std::uint8_t number = numbers.values[at++]; number != 0) visit(number, place_in(axes, {x, y, z}));
}

// The square of one island, and where its voxels are in it.
class Canvas {
 public:
  Canvas(const PlaneAxes& axes, const Extent& extent, IslandPicture& picture) : extent_(extent), picture_(&picture) {
    const std::array<double, 2> size_mm{(extent.last[0] - extent.first[0] + 1) * axes.right_mm,
                                        (extent.last[1] - extent.first[1] + 1) * axes.down_mm};
    const double px_per_mm = picture.side_px / std::max(size_mm[0], size_mm[1]);
    step_px_ = {axes.right_mm * px_per_mm, axes.down_mm * px_per_mm};
    for (std::size_t i = 0; i < 2; ++i) begin_px_[i] = 0.5 * (picture.side_px - size_mm[i] * px_per_mm);
    picture.greys.assign(static_cast<std::size_t>(picture.side_px) * static_cast<std::size_t>(picture.side_px), 0);
  }

  void draw(const std::array<int, 3>& place) {
    const double depth = extent_.last[2] == extent_.first[2]
                             ? 0.0
                             : static_cast<double>(place[2] - extent_.first[2]) / (extent_.last[2] - extent_.first[2]);
    const auto grey = static_cast<std::uint8_t>(std::lround(kNearestGrey + depth * (kFarthestGrey - kNearestGrey)));
    const auto [left, right] = pixels(0, place[0]);
    const auto [top, bottom] = pixels(1, place[1]);
    for (int row = top; row <= bottom; ++row)
      for (int column = left; column <= right; ++column) {
        std::uint8_t& pixel = picture_->greys[static_cast<std::size_t>(row * picture_->side_px + column)];
        pixel = std::max(pixel, grey);
      }
  }

 private:
  // The first and the last pixel of a column or row of voxels: one at least.
  [[nodiscard]] std::array<int, 2> pixels(std::size_t axis, int place) const {
    const double from = begin_px_[axis] + (place - extent_.first[axis]) * step_px_[axis], to = from + step_px_[axis];
    const int first = std::clamp(static_cast<int>(std::floor(from + kSamePixel)), 0, picture_->side_px - 1);
    return {first, std::clamp(static_cast<int>(std::ceil(to - kSamePixel)) - 1, first, picture_->side_px - 1)};
  }

  Extent extent_;
  IslandPicture* picture_;
  std::array<double, 2> step_px_{}, begin_px_{};
};

}  // namespace

std::vector<IslandPicture> island_pictures(const VoxelFile<std::uint8_t>& numbers, int side_px) {
  const PlaneAxes axes = axes_of(numbers.geometry, Plane::coronal);
  std::vector<Extent> extents(kNumbers);
  each_island_voxel(numbers, axes, [&](std::uint8_t number, const auto& place) { extents[number].include(place); });
  std::vector<IslandPicture> pictures(kNumbers);
  std::vector<Canvas> canvases;
  std::array<std::size_t, kNumbers> canvas_of{};
  for (std::size_t number = 1; number < kNumbers; ++number) {
    if (extents[number].last[0] < 0) continue;
    pictures[number].side_px = side_px;
    canvas_of[number] = canvases.size();
    canvases.emplace_back(axes, extents[number], pictures[number]);
  }
  each_island_voxel(numbers, axes,
                    [&](std::uint8_t number, const auto& place) { canvases[canvas_of[number]].draw(place); });
  return pictures;
}

}  // namespace osteon
