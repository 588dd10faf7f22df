// How a plane of a scan's voxels lies on the screen: sides, aspect, and the voxel under a pixel.
#pragma once
#include <array>
#include <cstdint>

#include "common/volume/case_description.hpp"
#include "viewer_client/imaging/patient_letters.hpp"

namespace osteon {

enum class Plane : std::uint8_t { axial, coronal, sagittal };
inline constexpr std::array kPlanes{Plane::axial, Plane::coronal, Plane::sagittal};

// A plane goes along the voxels, so that each voxel is seen as it was measured. It is the one that is nearest to the
// patient's, as radiologists look at it: left is on the right.
struct PlaneAxes {
  int right = 0, down = 1, through = 2;        // axes of the voxels
  bool flip_right = false, flip_down = false;  // the index falls in that direction
  bool flip_through = false;                   // slices count to the left, to the back or to the head
  double right_mm = 1.0, down_mm = 1.0;        // between neighbours
  int columns = 0, rows = 0, slices = 0;       // voxels along each
};
[[nodiscard]] PlaneAxes axes_of(const ScanGeometry& geometry, Plane plane);
[[nodiscard]] EdgeLetters letters_of(const PlaneAxes& axes, const ScanGeometry& geometry);

// The voxel at a column from the left and a row from the top.
[[nodiscard]] std::array<int, 3> voxel_at(const PlaneAxes& axes, int column, int row, int slice);
// Column, row and slice of a voxel.
[[nodiscard]] std::array<int, 3> place_in(const PlaneAxes& axes, const std::array<int, 3>& voxel);

// The rectangle of the plane within a widget, as large as its aspect allows, in the middle.
struct PlaneFrame {
  double left_px = 0.0, top_px = 0.0, width_px = 0.0, height_px = 0.0;
};
[[nodiscard]] PlaneFrame fit(const PlaneAxes& axes, double width_px, double height_px);
// Column and row under a pixel, also of one beside the rectangle: the nearest.
[[nodiscard]] std::array<int, 2> under(const PlaneAxes& axes, const PlaneFrame& frame, double x_px, double y_px);
// The middle of a voxel in the widget.
[[nodiscard]] std::array<double, 2> pixel_of(const PlaneAxes& axes, const PlaneFrame& frame, int column, int row);

}  // namespace osteon
