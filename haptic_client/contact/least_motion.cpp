#include "haptic_client/contact/least_motion.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace osteon::haptic {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

constexpr double kNoMotion_mm = 1e-10;
constexpr double kMostPushedOut_mm = 1.2e-4;  // what a point on its way out asks for, and rounding
// Conditions whose normal is nearly along a forbidden direction say nothing about the remaining motion.
constexpr double kLeastNormal2 = 1e-3;

Vec6 row_of(const Condition& condition, const MotionLimits& limits) noexcept {
  Vec6 row;
  Vec3 n = condition.n;
  if (limits.across) n -= n.dot(*limits.across) * *limits.across;
  row.head<3>() = n;
  if (limits.may_turn)
    row.tail<3>() = condition.m / limits.arm_mm;
  else
    row.tail<3>().setZero();
  return row;
}

// min |x - x0|² over row · x >= least.
struct Problem {
  std::array<Vec6, Conditions::kMost> row;
  std::array<double, Conditions::kMost> least;
  int count = 0;

  void add(const Vec6& r, double by) noexcept {
    row[static_cast<std::size_t>(count)] = r;
    least[static_cast<std::size_t>(count++)] = by;
  }
  bool solve(Vec6& x, bool& pressed) const noexcept;
};

// The active conditions, as an orthonormal base of their rows and the factors that make the rows of it: row_j = sum_i
// base_i upper(i, j).
class Pressing {
 public:
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] double pressure(int i) const noexcept { return pressure_[i]; }
  // The part of a row that the others leave, and the decrease of their pressures when it presses by one.
  [[nodiscard]] Vec6 left_of(const Vec6& row, Vec6& falls) const noexcept {
    Vec6 left = row, along = Vec6::Zero();
    for (int pass = 0; pass < 2; ++pass)  // twice is exact
      for (int i = 0; i < count_; ++i) {
        const double part = base_[i].dot(left);
        along[i] += part;
        left -= part * base_[i];
      }
    for (int i = count_ - 1; i >= 0; --i) {
      for (int j = i + 1; j < count_; ++j) along[i] -= upper_(i, j) * falls[j];
      falls[i] = along[i] / upper_(i, i);
    }
    return left;
  }
  void add(const Vec6& row, double pressure) noexcept {
    rows_[count_] = row;
    pressure_[count_] = pressure;
    append(count_);
    ++count_;
  }
  void relieve(const Vec6& falls, double by) noexcept {
    for (int i = 0; i < count_; ++i) pressure_[i] = std::max(0.0, pressure_[i] - by * falls[i]);
  }
  void drop(int which) noexcept {
    --count_;
    for (int i = which; i < count_; ++i) {
      rows_[i] = rows_[i + 1];
      pressure_[i] = pressure_[i + 1];
    }
    for (int i = which; i < count_; ++i) append(i);
  }

 private:
  void append(int k) noexcept {
    Vec6 left = rows_[k];
    upper_.col(k).setZero();
    for (int pass = 0; pass < 2; ++pass)
      for (int i = 0; i < k; ++i) {
        const double part = base_[i].dot(left);
        upper_(i, k) += part;
        left -= part * base_[i];
      }
    upper_(k, k) = left.norm();
    base_[k] = left / upper_(k, k);
  }
  Vec6 rows_[6], base_[6];
  double pressure_[6] = {};
  Eigen::Matrix<double, 6, 6> upper_;
  int count_ = 0;
};

// Goldfarb and Idnani's dual method: the condition that is violated most becomes active, and those that it relieves are
// dropped. There are six unknowns, so at most six are active at once. False: some contradict each other, or it takes
// too long; x then violates some.
bool Problem::solve(Vec6& x, bool& pressed) const noexcept {
  constexpr int kMostSteps = 40;
  constexpr double kDependent2 = 1e-9;
  Pressing pressing;
  bool solved = false;
  int broken = -1;
  double pressure = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    if (broken < 0) {
      double worst = kNoMotion_mm;
      for (int i = 0; i < count; ++i) {
        const double by = least[static_cast<std::size_t>(i)] - row[static_cast<std::size_t>(i)].dot(x);
        if (by > worst) worst = by, broken = i;
      }
      pressure = 0.0;
      if (broken < 0) {
        solved = true;
        break;
      }
    }
    const Vec6& n = row[static_cast<std::size_t>(broken)];
    Vec6 falls = Vec6::Zero();
    const Vec6 way = pressing.left_of(n, falls);
    // Go only as far as each of the others still presses.
    constexpr double kEndless = 1e300;
    double until = kEndless;
    int lets_go = -1;
    for (int i = 0; i < pressing.count(); ++i)
      if (falls[i] > 0.0 && pressing.pressure(i) < until * falls[i])
        until = pressing.pressure(i) / falls[i], lets_go = i;
    const double rises = way.squaredNorm();
    const bool free = pressing.count() < 6 && rises > kDependent2 * n.squaredNorm();
    const double whole = free ? (least[static_cast<std::size_t>(broken)] - n.dot(x)) / rises : kEndless;
    if (lets_go < 0 && !free) break;
    const double by = std::min(whole, until);
    if (free) x += by * way;
    pressing.relieve(falls, by);
    pressure += by;
    if (free && whole <= until) {
      pressing.add(n, pressure);
      broken = -1;
    } else {
      pressing.drop(lets_go);
    }
  }
  pressed = !solved;
  for (int i = 0; i < pressing.count(); ++i) pressed |= pressing.pressure(i) > kNoMotion_mm;
  return solved;
}

}  // namespace

Pose moved(const Pose& pose, const Motion& motion) noexcept {
  Pose result = pose;
  result.position_mm += motion.move_mm;
  const double angle = motion.turn_rad.norm();
  if (angle > 0.0)
    result.rotation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(angle, motion.turn_rad / angle)) * pose.rotation).normalized();
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

Motion least_motion(const Motion& wanted, const Conditions& conditions, const MotionLimits& limits,
                    bool& held) noexcept {
  Vec6 goal;
  goal.head<3>() = wanted.move_mm;
  if (limits.across) goal.head<3>() -= wanted.move_mm.dot(*limits.across) * *limits.across;
  if (limits.may_turn)
    goal.tail<3>() = limits.arm_mm * wanted.turn_rad;
  else
    goal.tail<3>().setZero();

  Problem problem;
  for (int i = 0; i < conditions.count(); ++i) {
    const Vec6 row = row_of(conditions[i], limits);
    if (row.squaredNorm() >= kLeastNormal2) problem.add(row, conditions[i].least_mm);
  }
  Vec6 x = goal;
  bool pressed = false;
  if (!problem.solve(x, pressed) || x.norm() > goal.norm() + kMostPushedOut_mm) {
    // A tool that is pushed out on two sides at once stays where it is: then standing still violates nothing.
    for (double& least : std::span(problem.least).first(static_cast<std::size_t>(problem.count)))
      least = std::min(0.0, least);
    x = goal;
    pressed = false;
    problem.solve(x, pressed);
  }
  held |= pressed;

  Motion result;
  result.move_mm = x.head<3>();
  if (limits.may_turn) result.turn_rad = x.tail<3>() / limits.arm_mm;
  return result;
}

}  // namespace osteon::haptic
