#include "haptic_client/device/falcon_kinematics.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon::haptic {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double rad(double degrees) { return degrees * std::numbers::pi / 180.0; }

// Lengths, m: arm a, parallelogram b, half its side on the grip c, its joints d = e, f and s along the leg's tangent,
// distance r of the motors from the middle.
constexpr double kA = 0.060, kB = 0.1025, kC = 0.01443, kD = 0.01125, kE = 0.01125, kF = -0.025, kR = 0.040,
                 kS = -0.02309;
constexpr std::array kLegs{rad(105.0), rad(-15.0), rad(-135.0)};

constexpr double kAngleAtZero_rad = rad(35.0), kAngleOfCount_rad = rad(0.036435);
constexpr double kMotorCountsPerNm = -1e4;

// A leg in its own plane. Its arm starts at (0, 0), and the parallelogram's far end is at (across, up). Both are
// rotated by the arm's angle and `second`. `length` is the parallelogram's length as seen in the plane.
struct Leg {
  double across, up, length;
  Vector3d d_across, d_length;  // by the grip's position; `up` is the grip's z
};

// Empty where the grip is further along the leg's tangent than the length of the parallelogram.
std::optional<Leg> leg_at(int i, const Vector3d& p) {
  const double cos = std::cos(kLegs[i]), sin = std::sin(kLegs[i]);
  const double u = p.x() * cos + p.y() * sin - kR;
  const double v = -p.x() * sin + p.y() * cos - kS;
  const double lean = v + kF;
  const double square = kB * kB - lean * lean;
  if (!(square > 0.0)) return std::nullopt;
  const double seen = std::sqrt(square);  // b sin θ3, with cos θ3 = (v + f)/b
  return Leg{u + kC, p.z(), kD + kE + seen, Vector3d(cos, sin, 0.0), -lean / seen * Vector3d(-sin, cos, 0.0)};
}

// The residual of the closure L² = (across − a cos θ)² + (up − a sin θ)², and its derivatives.
struct Closure {
  double residual, by_angle;
  Vector3d by_place;
};

Closure closure(const Leg& leg, double angle) {
  const double cos = std::cos(angle), sin = std::sin(angle);
  const double across = leg.across - kA * cos, up = leg.up - kA * sin;
  Closure out;
  out.residual = across * across + up * up - leg.length * leg.length;
  out.by_place = 2.0 * (across * leg.d_across + up * Vector3d::UnitZ() - leg.length * leg.d_length);
  out.by_angle = 2.0 * kA * (across * sin - up * cos);
  return out;
}

// Below this value, m², the arm and the parallelogram are in one line, within about half a degree.
constexpr double kStretched_m2 = 1e-2 * 2.0 * kA * kB;

}  // namespace

double falcon_angle_rad(double counts) noexcept { return kAngleAtZero_rad + kAngleOfCount_rad * counts; }
double falcon_counts(double angle_rad) noexcept { return (angle_rad - kAngleAtZero_rad) / kAngleOfCount_rad; }

std::optional<Vector3d> falcon_angles(const Vector3d& grip_m) noexcept {
  Vector3d angles;
  for (int i = 0; i < 3; ++i) {
    const std::optional<Leg> leg = leg_at(i, grip_m);
    if (!leg) return std::nullopt;
    // The law of cosines in the triangle of arm, parallelogram and the line to its far end; the knee points outwards.
    const double reach = std::hypot(leg->across, leg->up);
    const double cos = (reach * reach + kA * kA - leg->length * leg->length) / (2.0 * kA * reach);
    if (!(std::abs(cos) <= 1.0)) return std::nullopt;
    angles[i] = std::atan2(leg->up, leg->across) - std::acos(cos);
  }
  return angles;
}

std::optional<Vector3d> falcon_place(const Vector3d& angles_rad, const Vector3d& near_m) noexcept {
  constexpr int kMostSteps = 30;
  constexpr double kLongestStep_m = 0.02, kDone_m = 1e-10;
  Vector3d p = near_m;
  for (int step = 0; step < kMostSteps; ++step) {
    Matrix3d slope;
    Vector3d residual;
    bool knees_out = true;
    for (int i = 0; i < 3; ++i) {
      const std::optional<Leg> leg = leg_at(i, p);
      if (!leg) return std::nullopt;
      const Closure c = closure(*leg, angles_rad[i]);
      slope.row(i) = c.by_place.transpose();
      residual[i] = c.residual;
      knees_out = knees_out && c.by_angle < 0.0;
    }
    Vector3d move = -slope.partialPivLu().solve(residual);
    if (!move.allFinite()) return std::nullopt;
    const double far = move.norm();
    if (far > kLongestStep_m) move *= kLongestStep_m / far;
    p += move;
    if (far < kDone_m) {
      // Solutions behind the device or with a knee bent inwards exist too, but the grip cannot be there.
      if (p.z() > 0.0 && knees_out) return p;
      return std::nullopt;
    }
  }
  return std::nullopt;
}

std::optional<Matrix3d> falcon_jacobian(const Vector3d& angles_rad, const Vector3d& grip_m) noexcept {
  Matrix3d jacobian;
  for (int i = 0; i < 3; ++i) {
    const std::optional<Leg> leg = leg_at(i, grip_m);
    if (!leg) return std::nullopt;
    const Closure c = closure(*leg, angles_rad[i]);
    if (!(std::abs(c.by_angle) > kStretched_m2)) return std::nullopt;
    jacobian.row(i) = -c.by_place.transpose() / c.by_angle;
  }
  return jacobian;
}

Vector3d falcon_torques(const Vector3d& angles_rad, const Vector3d& grip_m, const Vector3d& force_n) noexcept {
  const std::optional<Matrix3d> jacobian = falcon_jacobian(angles_rad, grip_m);
  if (!jacobian) return Vector3d::Zero();
  const Vector3d torques = jacobian->transpose().partialPivLu().solve(force_n);
  return torques.allFinite() ? torques : Vector3d(Vector3d::Zero());
}

FalconCounts falcon_motors(const Vector3d& torques_nm) noexcept {
  Vector3d counts = kMotorCountsPerNm * torques_nm;
  if (!counts.allFinite()) return {};
  const double largest = counts.cwiseAbs().maxCoeff();
  if (largest > kFalconMaxMotor) counts *= kFalconMaxMotor / largest;
  FalconCounts out;
  for (int i = 0; i < 3; ++i) {
    out[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(
        std::clamp(std::lround(counts[i]), static_cast<long>(-kFalconMaxMotor), static_cast<long>(kFalconMaxMotor)));
  }
  return out;
}

}  // namespace osteon::haptic
