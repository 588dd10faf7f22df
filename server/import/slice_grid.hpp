// The regular grid for slices that lie parallel to each other, and how tilted or unevenly spaced slices come onto it.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/imaging/hu_volume.hpp"

namespace osteon::import {

// Slices of one size, orientation and pixel spacing.
struct SliceStack {
  int columns = 0, rows = 0;
  double column_mm = 1.0, row_mm = 1.0;                      // between neighbours along a row, and down the rows
  Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();  // orthonormal: along a row, down the rows, normal; LPS
  std::vector<Vec3> positions_mm;  // centre of each slice's first pixel, LPS; rising along the normal, at least two
};

struct SliceGrid {
  imaging::HuVolume volume;   // without values
  std::vector<Vec3> places;   // of each slice's first pixel, in voxels of the grid; empty if the slices are its planes
  double tilt_degrees = 0.0;  // between the slices' normal and the way from the first to the last
  double sideways_mm = 0.0;   // farthest from the line along the normal through the first slice
  double least_mm = 0.0, most_mm = 0.0;  // distances of neighbouring slices
};

// Slices closer than this lie at one position.
inline constexpr double kSamePosition_mm = 1e-3;
// A gap is one of missing slices if it is wider than so many times the usual one.
inline constexpr double kMissingSlices = 1.75;
// A gantry tilts by 30 degrees at most.
inline constexpr double kMostTilt_degrees = 45.0;

// The lower median; the gap that a person calls the distance of the slices. At least one gap.
[[nodiscard]] double usual_gap_mm(std::span<const double> gaps_mm);

// The widest gap in which slices are missing. It is wider than kMissingSlices times the usual gap, both of all gaps and
// of the seven around it: a protocol may change the distance for a part of the body, but not for a single gap.
[[nodiscard]] std::optional<std::size_t> gap_of_missing_slices(std::span<const double> gaps_mm);

// Slices whose distances differ by at most a fifth, and lie within a tenth of a step of even ones, are the planes of
// the grid: positions are often written with one decimal. Otherwise planes are as far apart as the closest slices, but
// no closer than pixels. The first and last slice are planes. If slices lie sideways of each other by more than half a
// pixel, the grid has columns and rows for all of them.
[[nodiscard]] SliceGrid grid_of(const SliceStack& stack);

// "tilted by 18.5 degrees, 1 to 3 mm apart"; empty if the slices are the planes of the grid.
[[nodiscard]] std::string irregularity(const SliceGrid& grid);

// Brings slices onto the planes of a grid: linearly within each slice, then linearly along the normal between the two
// slices beside the plane. What no pixel of a slice covers is air. Has memory for two slices.
class SliceResampler {
 public:
  using OnPlane = std::function<void(std::span<const std::int16_t>)>;
  // The grid must have places.
  SliceResampler(const SliceGrid& grid, int columns, int rows);
  // Takes the next slice, HU, row by row, and gives all planes up to it, in their order.
  void add(std::span<const std::int16_t> slice, const OnPlane& on_plane);

 private:
  void place(std::span<const std::int16_t> slice, const Vec3& at, std::vector<float>& plane) const;

  const SliceGrid& grid_;
  int columns_, rows_;
  std::size_t next_slice_ = 0;
  int next_plane_ = 0;
  std::vector<float> before_, here_;  // the last two slices, within the columns and rows of the grid
  std::vector<std::int16_t> plane_;
};

}  // namespace osteon::import
