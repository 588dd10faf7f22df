// Finds the site on a bone where a tool is set down: the surface, its direction, and the thickness of the bone there.
#pragma once
#include "common/core/result.hpp"
#include "common/volume/case.hpp"

namespace osteon::haptic {

struct EntrySite {
  Vec3 entry_mm = Vec3::Zero();  // on the imported surface
  Vec3 axis = Vec3::UnitZ();     // unit, into the bone: against the surface normal, averaged over a few millimetres
  Vec3 across_u = Vec3::UnitX(), across_v = Vec3::UnitY();  // unit, along the surface
  double thickness_mm = 0;                                  // of the bone along the axis; gaps under 3 mm count as bone
  double flatness_mm = 0;  // r.m.s. distance of the surface around the entry from its plane
};

// Where a ray from far out along `toward` to the bone's centre first meets bone. Error invalid_input: it meets none.
[[nodiscard]] Result<EntrySite> find_site_toward(const Case& bone, const Vec3& toward);
// The same along the parallel line nearest to the centre that meets bone, within 2 mm. The middle of a pelvis, or of
// two bones, is empty. Error invalid_input: there is no bone.
[[nodiscard]] Result<EntrySite> find_site_facing(const Case& bone, const Vec3& toward);
// Where the line through `point_mm` along `axis` meets bone, at most 30 mm in front of or behind the point. The axis is
// used as given.
[[nodiscard]] Result<EntrySite> find_site_at(const Case& bone, const Vec3& point_mm, const Vec3& axis);
// Beside another site, by u and v millimetres along its surface.
[[nodiscard]] Result<EntrySite> find_site_beside(const Case& bone, const EntrySite& site, double u_mm, double v_mm);

// Distance from `from_mm` along `axis` to bone, at most `reach_mm`; negative where there is none.
[[nodiscard]] double distance_to_bone_mm(const Case& bone, const Vec3& from_mm, const Vec3& axis, double reach_mm);

}  // namespace osteon::haptic
