// What lies beside phantom bones: tubes along bone for vessels and nerves, layers of cartilage, and footprints of
// ligaments. HU and sizes are assumptions [A], see deploy/docs/phantoms.md.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// A signed distance, mm, negative inside.
using Distance = std::function<double(const Vec3& at_mm)>;

inline constexpr double kCartilage_hu = 100.0, kLigament_hu = 80.0, kVessel_hu = 50.0, kNerve_hu = 30.0;
inline constexpr double kPopliteal_mm = 3.5;  // radius of the popliteal artery
inline constexpr double kFootprint_mm = 1.5;  // thickness of a footprint

// Everything within a radius of the line through at least two points, but for bone. Kind and HU are those of a vessel
// or of a nerve. `bone_mm` is called where the tube is.
[[nodiscard]] Structure tube(const std::string& name, LabelKind kind, std::vector<Vec3> line, double radius_mm,
                             const Distance& bone_mm);
// A layer on bone where the region is negative. It thins out towards the region's edge over its own thickness.
[[nodiscard]] Structure cartilage(const std::string& name, double thickness_mm, const Box& bounds,
                                  const Distance& bone_mm, const Distance& region_mm);
// Where a ligament begins: what lies within a radius of a point of the surface, near the bone.
[[nodiscard]] Structure footprint(const std::string& name, const Vec3& centre, double radius_mm,
                                  const Distance& bone_mm);

// A point beside which a line passes, and the direction in which it lies from there, a unit vector. The line is
// `clear_mm` off bone.
struct Beside {
  Vec3 point_mm = Vec3::Zero();
  Vec3 direction = Vec3::UnitY();
  double clear_mm = 0.0;
};
// A smooth line that passes beside all points in order and keeps clear of bone, as a vessel does that spans hollows.
// `span_mm` is the length of the hollows. Between points, everything is interpolated.
[[nodiscard]] std::vector<Vec3> line_beside(const std::vector<Beside>& points, double span_mm, const Distance& bone_mm);

// The line without its corners, between the same ends.
[[nodiscard]] std::vector<Vec3> rounded(const std::vector<Vec3>& line);

// The first point of the surface from a point in bone along a unit vector.
[[nodiscard]] Vec3 surface_from(const Vec3& inside, const Vec3& direction, const Distance& bone_mm);

}  // namespace osteon::phantoms
