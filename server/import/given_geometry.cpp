#include "server/import/given_geometry.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/core/read_number.hpp"

namespace osteon::import {
namespace {

constexpr std::string_view kAxisLetters[] = {"LR", "PA", "SI"};  // towards more and less of x, y, z

}  // namespace

Result<std::array<int, 3>> parse_size(std::string_view text) {
  const auto wrong = [&] {
    return bad_input("--size " + std::string(text.substr(0, 64)) +
                     " is not a number of voxels; write columns, rows and slices, 2 to " +
                     std::to_string(imaging::kLargestScanAxis) + " each and 4e9 in all, such as 512,512,300");
  };
  std::array<int, 3> size{};
  std::string_view rest = text;
  double voxels = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t end = axis < 2 ? rest.find(',') : rest.size();
    if (end == std::string_view::npos) return wrong();
    const auto count = read_number<int>(rest.substr(0, end));
    if (!count || *count < 2 || *count > imaging::kLargestScanAxis) return wrong();
    size[axis] = *count;
    voxels *= *count;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (voxels > kMostGivenVoxels) return wrong();
  return size;
}

Result<Eigen::Matrix3d> parse_axes(std::string_view text) {
  Eigen::Matrix3d directions = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; text.size() == 3 && i < 3; ++i)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const std::size_t letter = kAxisLetters[axis].find(text[i]);
      if (letter != std::string_view::npos) directions(axis, static_cast<Eigen::Index>(i)) = letter == 0 ? 1.0 : -1.0;
    }
  if (std::abs(directions.determinant()) < 0.5)
    return bad_input("--axes " + std::string(text.substr(0, 64)) +
                     " does not say where columns, rows and slices go; write a letter for each, of L or R, P or A, S "
                     "or I, such as LPS");
  return directions;
}

std::int16_t hu_of(double stored, const GivenGeometry& given) {
  return imaging::nearest_hu(given.slope * stored + given.intercept);
}

imaging::HuVolume volume_of(const std::array<int, 3>& dims, const GivenGeometry& given) {
  imaging::HuVolume volume;
  volume.dims = dims;
  volume.spacing_mm = given.spacing_mm;
  volume.directions = given.directions.value_or(Eigen::Matrix3d::Identity());
  return volume;
}

std::string source_of(std::string_view kind, const imaging::HuVolume& volume, const GivenGeometry& given) {
  return std::string(kind) + " CT, " + imaging::describe(volume) +
         (given.directions ? ", orientation as given" : ", orientation not in the file: left and right may be swapped");
}

}  // namespace osteon::import
