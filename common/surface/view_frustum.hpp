// Where somebody looks, and in how much detail the surface has to be drawn for that.
#pragma once
#include <optional>

#include "common/surface/surface_blocks.hpp"

namespace osteon {

// A camera, bone frame.
struct ViewFrustum {
  Vec3 eye_mm = Vec3::Zero();
  Vec3 target_mm = Vec3::Zero();  // what is in the middle of the picture
  double pixel_rad = 0;           // how wide a pixel is
  double view_rad = 0;            // from the middle of the picture to its corner
  std::optional<Vec3> up{};       // unit vector, which way is up in the picture; none: nobody knows
  friend bool operator==(const ViewFrustum&, const ViewFrustum&) = default;
};

// Nothing asks for any detail: everything is drawn as coarse as it can be.
inline constexpr double kNowhere_mm = -1.0;
[[nodiscard]] Focus focus_on_nothing();
// What fills the picture is drawn in full where a voxel is two pixels wide or more, at 2 h where it is at least one.
[[nodiscard]] Focus focus_of(const ViewFrustum& look, double pitch_mm);
// Round the tip of a tool in use.
[[nodiscard]] Focus focus_of_tool(const Vec3& tip_mm);
// Whether two looks are so near each other that nobody need be told of the second.
[[nodiscard]] bool nearly_equal(const ViewFrustum& a, const ViewFrustum& b);
[[nodiscard]] bool nearly_equal(const Focus& a, const Focus& b);

}  // namespace osteon
