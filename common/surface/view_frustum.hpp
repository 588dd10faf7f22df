// A viewer's camera, and the detail in which the surface must be drawn for it.
#pragma once
#include <optional>

#include "common/surface/surface_blocks.hpp"

namespace osteon {

// A camera, bone frame.
struct ViewFrustum {
  Vec3 eye_mm = Vec3::Zero();
  Vec3 target_mm = Vec3::Zero();  // the middle of the picture
  double pixel_rad = 0;           // angle of a pixel
  double view_rad = 0;            // angle from the middle of the picture to its corner
  std::optional<Vec3> up{};       // unit vector, up in the picture; none: unknown
  friend bool operator==(const ViewFrustum&, const ViewFrustum&) = default;
};

// No focus asks for detail: everything is drawn as coarsely as possible.
inline constexpr double kNowhere_mm = -1.0;
[[nodiscard]] Focus focus_on_nothing();
// The visible part is drawn in full where a voxel is at least two pixels wide, and at 2 h where it is at least one.
[[nodiscard]] Focus focus_of(const ViewFrustum& look, double pitch_mm);
// Around the tip of a tool in use.
[[nodiscard]] Focus focus_of_tool(const Vec3& tip_mm);
// Whether two views are so similar that the second need not be sent.
[[nodiscard]] bool nearly_equal(const ViewFrustum& a, const ViewFrustum& b);
[[nodiscard]] bool nearly_equal(const Focus& a, const Focus& b);

}  // namespace osteon
