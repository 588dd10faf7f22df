#include "common/radiology/c_arm.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace osteon::radiology {
namespace {

Result<void> check(const CArm& arm) {
  const auto field = [](const char* name) { return "the C-arm's " + std::string(name); };
  for (const auto& [name, value] :
       {std::pair{"isocentre_mm", &arm.isocentre_mm}, {"translation_mm", &arm.translation_mm}})
    if (!(value->cwiseAbs().maxCoeff() <= kMostOfCArm_mm && value->allFinite()))
      return bad_field(field(name), "must have three numbers of at most 1 km");
  for (const auto& [name, value] : {std::pair{"orbit_rad", arm.orbit_rad}, {"tilt_rad", arm.tilt_rad}})
    if (!std::isfinite(value)) return bad_field(field(name), "must be a number, in radians");
  for (const auto& [name, value] : {std::pair{"source_detector_mm", arm.source_detector_mm},
                                    {"source_isocentre_mm", arm.source_isocentre_mm},
                                    {"detector_mm", arm.detector_mm}})
    if (!(value > 0.0 && value <= kMostOfCArm_mm)) return bad_field(field(name), "must be above 0 and at most 1 km");
  for (const auto& [name, value] : {std::pair{"columns", arm.columns}, {"rows", arm.rows}})
    if (value < 1 || value > kMostPixelsOfSide)
      return bad_field(field(name), "must be from 1 to " + std::to_string(kMostPixelsOfSide));
  return {};
}

}  // namespace

PixelBox shadow_of(const Box& box, const ConeBeam& beam) {
  const PixelGrid& grid = beam.detector;
  const PixelBox all = grid.whole();
  Vec3 normal = grid.column_mm.cross(grid.row_mm).normalized();
  double distance = normal.dot(grid.first_mm - beam.source_mm);
  if (distance < 0.0) {
    normal = -normal;
    distance = -distance;
  }
  double low_column = 1e30, high_column = -1e30, low_row = 1e30, high_row = -1e30;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1) != 0 ? box.max_mm.x() : box.min_mm.x(),
                 (corner & 2) != 0 ? box.max_mm.y() : box.min_mm.y(),
                 (corner & 4) != 0 ? box.max_mm.z() : box.min_mm.z());
    const double depth = normal.dot(p - beam.source_mm);
    if (depth <= 1e-3 * distance) return all;
    const Vec3 hit = beam.source_mm + (distance / depth) * (p - beam.source_mm) - grid.first_mm;
    const double column = hit.dot(grid.column_mm) / grid.column_mm.squaredNorm();
    const double row = hit.dot(grid.row_mm) / grid.row_mm.squaredNorm();
    low_column = std::min(low_column, column);
    high_column = std::max(high_column, column);
    low_row = std::min(low_row, row);
    high_row = std::max(high_row, row);
  }
  // One pixel more on each side, for rounding.
  const auto pixel = [](double at, int last) { return static_cast<int>(std::clamp(at, -1.0, last + 1.0)); };
  const PixelBox shadow{
      pixel(std::floor(low_column) - 1.0, all.last_column), pixel(std::floor(low_row) - 1.0, all.last_row),
      pixel(std::ceil(high_column) + 1.0, all.last_column), pixel(std::ceil(high_row) + 1.0, all.last_row)};
  return shadow.common(all);
}

CArm c_arm_at(View view, const Vec3& isocentre_mm) {
  CArm arm;
  arm.isocentre_mm = isocentre_mm;
  if (view == View::lateral) arm.orbit_rad = 0.5 * std::numbers::pi;
  if (view == View::axial) arm.tilt_rad = 0.5 * std::numbers::pi;
  return arm;
}

Result<ConeBeam> beam_of(const CArm& arm) {
  if (auto good = check(arm); !good) return tl::unexpected(std::move(good).error());
  // The tilt acts first, in the arm's own plane; the orbit turns that plane.
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(arm.orbit_rad, Vec3::UnitZ()) * Eigen::AngleAxisd(-arm.tilt_rad, Vec3::UnitX()))
          .toRotationMatrix();
  const Vec3 right = turn.col(0), down = -turn.col(2), to_detector = -turn.col(1);
  const Vec3 centre = arm.isocentre_mm + arm.translation_mm;
  const Vec3 source = centre - arm.source_isocentre_mm * to_detector;
  return ConeBeam{source, grid_about(source + arm.source_detector_mm * to_detector, right, down,
                                     arm.detector_mm / arm.columns, arm.columns, arm.rows)};
}

}  // namespace osteon::radiology
