// The bone on a compliant mount: one rigid body on a spring and a damper in all six degrees of freedom about a centre.
// Users who push it feel each other through it (Morris et al., 2004). World frame: axes through the centre at rest.
//
//   M x'' + B x' + K x = F,   J t'' + B_t t' + K_t t = T,   t: rotation vector, a fraction of a radian
//
// At rest x = F / K and t = T / K_t, with F the sum of all forces and T that of their moments about the centre. Two
// users who press on springs k1, k2 from e1, e2 along one line through the centre meet at
//
//   x = (k1 e1 + k2 e2) / (K + k1 + k2),   f1 = k1 (e1 - x)
//
// A line that passes the centre at distance r has 1 / (1/K + r²/K_t) in place of K.
#pragma once
#include "common/geometry/pose.hpp"

namespace osteon {

// Force and moment about the mount's centre, world axes; N and N·mm.
struct Load {
  Vec3 force_n = Vec3::Zero(), moment_nmm = Vec3::Zero();

  // The load of a force at a point, `arm_mm` from the centre.
  [[nodiscard]] static Load at(const Vec3& force_n, const Vec3& arm_mm) { return {force_n, arm_mm.cross(force_n)}; }
  friend Load operator+(const Load& a, const Load& b) { return {a.force_n + b.force_n, a.moment_nmm + b.moment_nmm}; }
  friend Load operator*(double k, const Load& a) { return {k * a.force_n, k * a.moment_nmm}; }
  [[nodiscard]] bool finite() const { return force_n.allFinite() && moment_nmm.allFinite(); }
};

// Displacement of the bone from rest: motion of the centre, and the rotation vector about it. World axes.
struct Shift {
  Vec3 place_mm = Vec3::Zero(), turn_rad = Vec3::Zero();

  [[nodiscard]] bool finite() const { return place_mm.allFinite() && turn_rad.allFinite(); }
};

struct MountParams {
  double mass_kg = 2.0;                    // of the bone and everything that moves with it [A]
  double inertia_kg_mm2 = 5000.0;          // about every axis through the centre [A]
  double stiffness_n_per_mm = 5.0;         // [A]
  double stiffness_nmm_per_rad = 20000.0;  // [A]
  double damping = 1.0;                    // fraction of the critical damping, in translation and rotation
  // Stops: the bone never moves beyond them. A larger rotation would not be small, nor the spring linear.
  double most_mm = 20.0, most_rad = 0.35;
  Pose pose_world_rest;           // of the bone, unloaded
  Vec3 centre_mm = Vec3::Zero();  // world

  [[nodiscard]] bool good() const;  // all finite; masses, springs and stops positive; damping not negative
};

// The mount of a room's bone, as all members know it: about this point, resting in its imported pose.
[[nodiscard]] MountParams mount_about(const Vec3& centre_mm);

// The pose of the bone for this shift.
[[nodiscard]] Pose pose_world_bone(const MountParams& mount, const Shift& shift);

// No clock, no thread. Implicit Euler: stable for any step, exact at rest, first order in the step during motion. It
// never has more energy than the loads put in: S' - S <= F·dx + T·dt.
class Mount {
 public:
  // Aborts unless the parameters are good().
  explicit Mount(const MountParams& params);

  // `dt_s` must be at least 0. A load that is not finite counts as zero.
  void step(const Load& load, double dt_s) noexcept;

  [[nodiscard]] const MountParams& params() const noexcept { return params_; }
  [[nodiscard]] const Shift& shift() const noexcept { return shift_; }
  [[nodiscard]] Pose pose() const { return pose_world_bone(params_, shift_); }
  // Energy in springs and motion, mJ.
  [[nodiscard]] double stored_mj() const noexcept;

 private:
  MountParams params_;
  Shift shift_;
  Vec3 velocity_mm_per_s_ = Vec3::Zero(), spin_rad_per_s_ = Vec3::Zero();
};

}  // namespace osteon
