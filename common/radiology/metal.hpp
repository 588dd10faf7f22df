// The shadow of metal: of tools, screws and implants.
#pragma once
#include <span>

#include "common/radiology/c_arm.hpp"
#include "common/tools/implicit.hpp"

namespace osteon::radiology {

struct MetalSolid {
  Implicit solid;  // in the bone's frame, as placed() makes it; negative inside
  double attenuation_per_mm = 0.0;
};

// Lengths in metal are exact to this, for each face that a ray crosses, where the distance is 1-Lipschitz: the solids
// of implicit.hpp, and the built-in tools. The distance of a tool that was read as a mesh is interpolated, and may rise
// faster. Then a step may pass over a part that is thinner than the step.
inline constexpr double kMetalStep_mm = 0.02;

// Length of the part of a ray that lies in the solid, mm. A 1-Lipschitz distance to the surface bounds each step, so
// no surface is stepped over.
[[nodiscard]] double length_in(const Implicit& solid, const Vec3& from_mm, const Vec3& to_mm);

// Sets the pixels of a box to what the solids weaken their rays, ∫ μ dl: a layer of its own beside the radiograph.
// When a solid moves, the boxes to set again are its shadows (shadow_of()) before and after. The solids displace no
// bone: a screw's hole is a cut. Where solids overlap, each counts.
void cast_metal(const ConeBeam& beam, std::span<const MetalSolid> solids, const PixelBox& box, std::span<float> metal);

}  // namespace osteon::radiology
