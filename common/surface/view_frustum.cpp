#include "common/surface/view_frustum.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {
namespace {

constexpr double kToolFull_mm = 8.0, kToolHalf_mm = 16.0;
// Extends the visible part at the target's distance, so that a small turn of the camera shows nothing coarse.
constexpr double kMargin = 1.25;
// A position that moves by less than this fraction of its distance changes nothing visible.
constexpr double kSmallStep = 1.0 / 16.0;

}  // namespace

Focus focus_on_nothing() { return {Vec3::Zero(), kNowhere_mm, kNowhere_mm}; }

Focus focus_of(const ViewFrustum& look, double pitch_mm) {
  const double distance_mm = (look.target_mm - look.eye_mm).norm();
  const double pixel_mm = distance_mm * look.pixel_rad;
  const double seen_mm = kMargin * distance_mm * std::tan(look.view_rad);
  Focus focus{look.target_mm, kNowhere_mm, kNowhere_mm};
  if (2.0 * pixel_mm <= pitch_mm) focus.full_mm = seen_mm;
  if (pixel_mm <= pitch_mm) focus.half_mm = 2.0 * seen_mm;
  return focus;
}

Focus focus_of_tool(const Vec3& tip_mm) { return {tip_mm, kToolFull_mm, kToolHalf_mm}; }

bool nearly_equal(const ViewFrustum& a, const ViewFrustum& b) {
  if (a.up.has_value() != b.up.has_value()) return false;
  if (a.up && (*a.up - *b.up).norm() > kSmallStep) return false;  // radians, while small
  const double small_mm = kSmallStep * (a.target_mm - a.eye_mm).norm();
  return (a.eye_mm - b.eye_mm).norm() <= small_mm && (a.target_mm - b.target_mm).norm() <= small_mm &&
         std::abs(a.pixel_rad - b.pixel_rad) <= kSmallStep * a.pixel_rad &&
         std::abs(a.view_rad - b.view_rad) <= kSmallStep * a.view_rad;
}

bool nearly_equal(const Focus& a, const Focus& b) {
  const double small_mm = std::max(0.0, 2.0 * kSmallStep * std::max(a.full_mm, 0.5 * a.half_mm));
  return (a.position_mm - b.position_mm).norm() <= small_mm && std::abs(a.full_mm - b.full_mm) <= small_mm &&
         std::abs(a.half_mm - b.half_mm) <= 2.0 * small_mm;
}

}  // namespace osteon
