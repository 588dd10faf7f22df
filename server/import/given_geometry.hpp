// Scans whose files say nothing of their voxels' size, place or unit: a person gives them.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

// As many as a DICOM series may have.
inline constexpr double kMostGivenVoxels = 4e9;

struct GivenGeometry {
  Vec3 spacing_mm = Vec3::Ones();  // between neighbours along columns, rows and slices
  // Where columns, rows and slices go, LPS. Absent: to the left, to the back and to the head, as in most files; left
  // and right are then a guess.
  std::optional<Eigen::Matrix3d> directions;
  double slope = 1.0, intercept = 0.0;  // HU = slope * stored + intercept
};

// "X,Y,Z": columns, rows and slices, 2 to 16384 each, at most 4e9 voxels. Error: invalid_input.
[[nodiscard]] Result<std::array<int, 3>> parse_size(std::string_view text);
// "LPS": a letter for columns, rows and slices each: L or R, A or P, S or I. Error: invalid_input.
[[nodiscard]] Result<Eigen::Matrix3d> parse_axes(std::string_view text);

// Whole HU of a finite number: fractions are rounded, and what exceeds int16 is clamped.
[[nodiscard]] std::int16_t hu_of(double stored, const GivenGeometry& given);

// A volume without values; its first voxel is the origin of LPS.
[[nodiscard]] imaging::HuVolume volume_of(const std::array<int, 3>& dims, const GivenGeometry& given);
// "raw CT, 64x64x93, 3.2x3.2x1.5 mm, ..."
[[nodiscard]] std::string source_of(std::string_view kind, const imaging::HuVolume& volume, const GivenGeometry& given);

}  // namespace osteon::import
