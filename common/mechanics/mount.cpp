#include "common/mechanics/mount.hpp"

#include <cmath>

#include "common/core/check.hpp"

namespace osteon {
namespace {

constexpr double kSI = 1e-3;  // kg to N·s²/mm, and kg·mm² to N·mm·s²

struct Oscillator {
  double mass, damping, stiffness, most;
};

Oscillator of_place(const MountParams& p) {
  const double mass = kSI * p.mass_kg;
  return {mass, p.damping * 2.0 * std::sqrt(p.stiffness_n_per_mm * mass), p.stiffness_n_per_mm, p.most_mm};
}
Oscillator of_turn(const MountParams& p) {
  const double mass = kSI * p.inertia_kg_mm2;
  return {mass, p.damping * 2.0 * std::sqrt(p.stiffness_nmm_per_rad * mass), p.stiffness_nmm_per_rad, p.most_rad};
}

// Uses the forces of spring and damper at the end of the step. A stop ends the motion, which can only lose energy,
// because the stop is on the way in which load and spring push.
void advance(const Oscillator& o, const Vec3& load, double dt, Vec3& at, Vec3& speed) {
  speed = (speed + dt / o.mass * (load - o.stiffness * at)) / (1.0 + dt / o.mass * (o.damping + dt * o.stiffness));
  const Vec3 next = at + dt * speed;
  const double size = next.norm();
  if (size <= o.most) {
    at = next;
    return;
  }
  at = next * (o.most / size);
  speed.setZero();
}

}  // namespace

bool MountParams::good() const {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  return positive(mass_kg) && positive(inertia_kg_mm2) && positive(stiffness_n_per_mm) &&
         positive(stiffness_nmm_per_rad) && std::isfinite(damping) && damping >= 0.0 && positive(most_mm) &&
         positive(most_rad) && most_rad < 3.0 && centre_mm.allFinite() && pose_world_rest.position_mm.allFinite() &&
         std::abs(pose_world_rest.rotation.norm() - 1.0) < 1e-6;
}

MountParams mount_about(const Vec3& centre_mm) {
  MountParams mount;
  mount.centre_mm = centre_mm;
  return mount;
}

Pose pose_world_bone(const MountParams& mount, const Shift& shift) {
  const double angle = shift.turn_rad.norm();
  Pose about_centre;
  if (angle > 0.0) about_centre.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, shift.turn_rad / angle));
  about_centre.position_mm = mount.centre_mm + shift.place_mm - about_centre.rotation * mount.centre_mm;
  return about_centre * mount.pose_world_rest;
}

Mount::Mount(const MountParams& params) : params_(params) { OSTEON_CHECK(params.good()); }

void Mount::step(const Load& load, double dt_s) noexcept {
  const Load held = load.finite() ? load : Load{};
  advance(of_place(params_), held.force_n, dt_s, shift_.place_mm, velocity_mm_per_s_);
  advance(of_turn(params_), held.moment_nmm, dt_s, shift_.turn_rad, spin_rad_per_s_);
}

double Mount::stored_mj() const noexcept {
  return 0.5 * (params_.stiffness_n_per_mm * shift_.place_mm.squaredNorm() +
                params_.stiffness_nmm_per_rad * shift_.turn_rad.squaredNorm() +
                kSI * params_.mass_kg * velocity_mm_per_s_.squaredNorm() +
                kSI * params_.inertia_kg_mm2 * spin_rad_per_s_.squaredNorm());
}

}  // namespace osteon
