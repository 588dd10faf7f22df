#include "haptic_client/device/rate_control.hpp"

namespace osteon::haptic {

void RateControl::step(const SpaceMouseState& state, double dt_s) noexcept {
  pose_.position_mm += params_.fastest_mm_per_s * dt_s * beyond_rest(state.push, params_.rest);
  const double far = pose_.position_mm.norm();
  if (far > params_.reach_mm) pose_.position_mm *= params_.reach_mm / far;
  const Vec3 turn = params_.fastest_rad_per_s * dt_s * beyond_rest(state.twist, params_.rest);
  const double angle = turn.norm();
  if (angle > 0.0)
    pose_.rotation = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * pose_.rotation).normalized();
}

}  // namespace osteon::haptic
