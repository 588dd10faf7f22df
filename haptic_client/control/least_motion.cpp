#include "haptic_client/control/least_motion.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

constexpr double kNothing_mm = 1e-10;
// Conditions whose normal is nearly along a direction that may not be gone say nothing about what is left.
constexpr double kLeastNormal2 = 1e-3;

Vec6 row_of(const Condition& condition, const MotionLimits& limits) noexcept {
  Vec6 row;
  Vec3 n = condition.n;
  if (limits.across) n -= n.dot(*limits.across) * *limits.across;
  row.head<3>() = n;
  if (limits.may_turn) row.tail<3>() = condition.m / limits.arm_mm;
  else row.tail<3>().setZero();
  return row;
}

}  // namespace

Pose moved(const Pose& pose, const Motion& motion) noexcept {
  Pose result = pose;
  result.position_mm += motion.move_mm;
  const double angle = motion.turn_rad.norm();
  if (angle > 0.0)
    result.rotation = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, motion.turn_rad / angle)) * pose.rotation).normalized();
  return result;
}

Motion between(const Pose& from, const Pose& to) noexcept {
  Motion motion;
  motion.move_mm = to.position_mm - from.position_mm;
  Eigen::Quaterniond turn = to.rotation * from.rotation.conjugate();
  if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  if (sine > 1e-12) motion.turn_rad = turn.vec() * (2.0 * std::atan2(sine, turn.w()) / sine);
  return motion;
}

Motion least_motion(const Motion& wanted, const Conditions& conditions, const MotionLimits& limits, bool& held) noexcept {
  constexpr int kMostKept = 24, kMostRounds = 40, kSweeps = 60;
  Vec6 x;
  x.head<3>() = wanted.move_mm;
  if (limits.across) x.head<3>() -= wanted.move_mm.dot(*limits.across) * *limits.across;
  if (limits.may_turn) x.tail<3>() = limits.arm_mm * wanted.turn_rad;
  else x.tail<3>().setZero();

  std::array<Vec6, kMostKept> rows;
  std::array<double, kMostKept> least, weight, pressure;
  std::array<int, kMostKept> which;
  int kept = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    // The condition that is broken most.
    double worst = kNothing_mm;
    int broken = -1;
    Vec6 worst_row;
    for (int i = 0; i < conditions.count(); ++i) {
      const Vec6 row = row_of(conditions[i], limits);
      const double by = conditions[i].least_mm - row.dot(x);
      if (by <= worst || row.squaredNorm() < kLeastNormal2) continue;
      worst = by;
      broken = i;
      worst_row = row;
    }
    if (broken < 0) break;
    const bool known = std::find(which.begin(), which.begin() + kept, broken) != which.begin() + kept;
    if (!known) {
      if (kept == kMostKept) break;
      const auto k = static_cast<std::size_t>(kept++);
      rows[k] = worst_row;
      least[k] = conditions[broken].least_mm;
      weight[k] = worst_row.squaredNorm();
      pressure[k] = 0.0;
      which[k] = broken;
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      double largest = 0.0;
      for (int i = 0; i < kept; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const double next = std::max(0.0, pressure[k] + (least[k] - rows[k].dot(x)) / weight[k]), change = next - pressure[k];
        if (change == 0.0) continue;
        pressure[k] = next;
        x += change * rows[k];
        largest = std::max(largest, std::abs(change));
      }
      if (largest < 0.1 * kNothing_mm) break;
    }
  }
  for (int i = 0; i < kept; ++i) held |= pressure[static_cast<std::size_t>(i)] > kNothing_mm;

  Motion result;
  result.move_mm = x.head<3>();
  if (limits.may_turn) result.turn_rad = x.tail<3>() / limits.arm_mm;
  return result;
}

}  // namespace osteon::haptic
