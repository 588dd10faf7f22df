#include "common/mechanics/simulated_hand.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

HandParams expert_hand() { return {}; }

HandParams novice_hand() {
  HandParams hand;
  hand.damping_n_s_per_mm = 0.141;
  hand.stiffness_n_per_mm = 2.0;
  return hand;
}

HandParams scaled(const HandParams& hand, double force, double length) {
  HandParams result = hand;
  result.push_n *= force;
  // Forces per millimetre of the handle's position, speed or acceleration.
  result.mass_kg *= force * length;
  result.damping_n_s_per_mm *= force * length;
  result.stiffness_n_per_mm *= force * length;
  result.lateral_n_per_mm *= force * length;
  return result;
}

void Hand::place(const Vec3& at_mm) noexcept {
  position_mm_ = rest_mm_ = at_mm;
  velocity_mm_per_s_.setZero();
  push_n_ = in_mode_s_ = 0.0;
  mode_ = HandMode::carry;
}

void Hand::step(const HandCommand& command, const Vec3& force_n, double dt_s) noexcept {
  if (command.mode != mode_) {
    // The push starts from the position of the hand, so the spring has no tension left from the approach.
    if (command.mode == HandMode::push) rest_mm_ = position_mm_;
    mode_ = command.mode;
    in_mode_s_ = 0.0;
  }
  in_mode_s_ += dt_s;

  if (mode_ == HandMode::rig) {
    velocity_mm_per_s_ = (command.target_mm - position_mm_) / dt_s;
    position_mm_ = rest_mm_ = command.target_mm;
    push_n_ = 0.0;
    return;
  }
  if (mode_ == HandMode::carry) {
    rest_mm_ = command.target_mm;
    push_n_ = 0.0;
  } else if (mode_ == HandMode::push) {
    push_n_ = params_.push_n * std::min(1.0, in_mode_s_ / params_.rise_s);
  } else if (in_mode_s_ > params_.reaction_s) {
    push_n_ *= std::exp(-dt_s / params_.release_s);
  }

  constexpr int kSubSteps = 4;
  const double dt = dt_s / kSubSteps;
  const double mass = 1e-3 * params_.mass_kg;  // N·s²/mm
  const double lateral_damping = 2.0 * std::sqrt(params_.lateral_n_per_mm * mass);
  const Vec3& axis = command.axis;
  for (int i = 0; i < kSubSteps; ++i) {
    if (mode_ == HandMode::push) {
      const double lag_mm = (position_mm_ - rest_mm_).dot(axis);
      rest_mm_ = command.target_mm + axis * ((rest_mm_ - command.target_mm).dot(axis) + lag_mm * dt / params_.follow_s);
    }
    const Vec3 stretch = rest_mm_ - position_mm_;
    const double axial_force_n = push_n_ + params_.stiffness_n_per_mm * stretch.dot(axis) + force_n.dot(axis);
    const Vec3 lateral_force_n =
        params_.lateral_n_per_mm * (stretch - stretch.dot(axis) * axis) + force_n - force_n.dot(axis) * axis;
    const double axial_speed = velocity_mm_per_s_.dot(axis);
    // Damping is implicit, so that a light hand on a scaled-down device stays stable.
    const double axial = (axial_speed + dt * axial_force_n / mass) / (1.0 + dt * params_.damping_n_s_per_mm / mass);
    const Vec3 lateral =
        (velocity_mm_per_s_ - axial_speed * axis + dt / mass * lateral_force_n) / (1.0 + dt * lateral_damping / mass);
    velocity_mm_per_s_ = axial * axis + lateral;
    position_mm_ += dt * velocity_mm_per_s_;
  }
}

}  // namespace osteon
