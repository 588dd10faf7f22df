// Three linked planes through one point of the bone, and where things lie in their images.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "common/radiology/pixel_grid.hpp"
#include "common/tools/implicit.hpp"

namespace osteon {

using Pixel = Eigen::Vector2d;  // column and row; whole numbers are centres of pixels

// Which planes: axial, coronal and sagittal; or along the tool, along it turned by 90°, and across its tip.
enum class SliceAxes { patient, tool };
inline constexpr std::size_t kSlices = 3;

struct ImageSize {
  int columns = 1, rows = 1;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

struct LinkedSlices {
  SliceAxes axes = SliceAxes::patient;
  Vec3 point_mm = Vec3::Zero();   // the planes' common point
  Vec3 centre_mm = Vec3::Zero();  // of the images; its projection, where it is not in a plane
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // of the tool
  double pixel_mm = 0.5;
  std::array<ImageSize, kSlices> images{};
};

// The planes of the view, as patient_planes() and tool_planes() orient them.
[[nodiscard]] std::array<radiology::PixelGrid, kSlices> planes_of(const LinkedSlices& view);

// Unit vector through the plane, away from who looks at the image.
[[nodiscard]] Vec3 normal_of(const radiology::PixelGrid& plane);
// Where the projection of a point lies in the image. Directions of the grid are perpendicular.
[[nodiscard]] Pixel pixel_at(const radiology::PixelGrid& plane, const Vec3& point_mm);
// How far a point is from the plane, along normal_of().
[[nodiscard]] double depth_mm(const radiology::PixelGrid& plane, const Vec3& point_mm);

// A round length for a scale bar: 1, 2 or 5 times a power of ten, mm, at most `most_mm`, which is above zero.
[[nodiscard]] double scale_bar_mm(double most_mm);

// The outline of a solid in a plane, as short lines. Exact to 0.01 pixel where the distance is smooth. `finest_px`: the
// side of the squares in which the outline is a line.
struct OutlinePart {
  Pixel from, to;
};
[[nodiscard]] std::vector<OutlinePart> outline_in(const radiology::PixelGrid& plane, const Implicit& solid,
                                                  double finest_px = 2.0);

// A line in space as an image shows it: the part of its projection that is in the image, and where it goes through the
// plane, if that is in the image. None: no part of it is in the image.
struct ProjectedLine {
  Pixel from, to;
  std::optional<Pixel> through;
};
[[nodiscard]] std::optional<ProjectedLine> project(const radiology::PixelGrid& plane, const Vec3& point_mm,
                                                   const Vec3& direction);

}  // namespace osteon
