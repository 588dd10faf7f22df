// Tests what a contact allows and what a cut leaves, against closed forms and by other ways of computing.
#include "haptic_client/contact/least_motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "haptic_client/contact/sweep.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic::test {
namespace {

Condition wall_contact(const Vec3& n, double least_mm = 0.0, const Vec3& at = Vec3::Zero()) {
  return {n, at.cross(n), least_mm};
}
Motion solve(const Motion& wanted, const std::vector<Condition>& walls, bool& held, const MotionLimits& limits = {}) {
  Conditions conditions;
  for (const Condition& condition : walls) conditions.add(condition);
  held = false;
  return least_motion(wanted, conditions, limits, held);
}
double breaks_mm(const Motion& m, const std::vector<Condition>& walls) {
  double most = 0.0;
  for (const Condition& c : walls) most = std::max(most, c.least_mm - c.n.dot(m.move_mm) - c.m.dot(m.turn_rad));
  return most;
}

// Two walls that nearly face each other, like those of a kerf. What goes down into the wedge between them ends in its
// edge.
TEST(LeastMotion, AWedgeHoweverNarrowIsExact) {
  for (const double half_angle : {0.5, 0.1, 0.02, 0.004}) {
    // The wedge opens along +z. Its walls are a tenth of a millimetre from the tip along their normals.
    const double s = std::sin(half_angle), c = std::cos(half_angle);
    const std::vector<Condition> walls = {wall_contact({c, 0, s}, -0.1), wall_contact({-c, 0, s}, -0.1)};
    bool held = false;
    const Motion down = solve({{0.02, 0.3, -100.0}, Vec3::Zero()}, walls, held, {.may_turn = false});
    EXPECT_TRUE(held);
    EXPECT_NEAR(down.move_mm.x(), 0.0, 1e-7) << half_angle;
    EXPECT_NEAR(down.move_mm.y(), 0.3, 1e-12) << half_angle;
    EXPECT_NEAR(down.move_mm.z(), -0.1 / s, 1e-6) << half_angle;
    // Nothing holds it on the way out.
    const Motion out = solve({{0.0, 0.0, 1.0}, Vec3::Zero()}, walls, held, {.may_turn = false});
    EXPECT_FALSE(held);
    EXPECT_EQ(out.move_mm.z(), 1.0);
  }
}

// Both sides of a kerf press on the tool. It stays between them and slides along as it is moved.
TEST(LeastMotion, WhatIsPressedFromTwoSidesStaysAndSlides) {
  std::vector<Condition> walls;
  for (int i = 0; i < 40; ++i) {
    const Vec3 at(0.5 * (i % 8), 0, -0.7 * (i / 8));
    walls.push_back(wall_contact(Vec3::UnitY(), 1e-4, at));
    walls.push_back(wall_contact(-Vec3::UnitY(), 1e-4, at));
  }
  bool held = false;
  const Motion motion = solve({{0.05, 0.3, 0.2}, {0.01, 0.002, 0.01}}, walls, held);
  EXPECT_TRUE(held);
  EXPECT_NEAR(motion.move_mm.x(), 0.05, 1e-9);
  EXPECT_NEAR(motion.move_mm.y(), 0.0, 1e-9);
  EXPECT_NEAR(motion.move_mm.z(), 0.2, 1e-9);
  EXPECT_NEAR(motion.turn_rad.y(), 0.002, 1e-9);
  EXPECT_NEAR(std::hypot(motion.turn_rad.x(), motion.turn_rad.z()), 0.0, 1e-9);
}

// The result is the nearest motion: no allowed motion, found by going between random ones and it, is nearer.
TEST(LeastMotion, NoAllowedMotionIsNearer) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto vec = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  int pressed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const MotionLimits limits{.arm_mm = 20.0, .may_turn = trial % 3 != 0};
    std::vector<Condition> walls;
    for (int i = 0; i < 60; ++i)
      walls.push_back(wall_contact(vec().normalized(), -0.2 * std::abs(normal(random)) * (i % 4), 15.0 * vec()));
    const Motion wanted{vec(), 0.05 * vec()};
    bool held = false;
    const Motion found = solve(wanted, walls, held, limits);
    ASSERT_LT(breaks_mm(found, walls), 1e-8) << trial;
    pressed += held;
    const auto off = [&](const Motion& m) {
      return (m.move_mm - wanted.move_mm).squaredNorm() +
             (limits.may_turn ? 400.0 * (m.turn_rad - wanted.turn_rad).squaredNorm() : 0.0);
    };
    for (int i = 0; i < 300; ++i) {
      Motion other{found.move_mm + 0.01 * vec(), found.turn_rad + (limits.may_turn ? 0.0005 : 0.0) * vec()};
      if (breaks_mm(other, walls) > 0.0) continue;
      EXPECT_GT(off(other), off(found) - 1e-7) << trial;
    }
    // Standing still is allowed here, so the result lies on the ball over the wanted motion: x · (x - w) <= 0.
    const double inward = found.move_mm.dot(found.move_mm - wanted.move_mm) +
                          (limits.may_turn ? 400.0 * found.turn_rad.dot(found.turn_rad - wanted.turn_rad) : 0.0);
    EXPECT_LT(inward, 1e-7) << trial;
  }
  EXPECT_GT(pressed, 250);
}

// A group of points at once gives the same result as its points one by one, for the body of every tool.
TEST(CutShape, AGroupOfPointsIsItsPoints) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  int tried = 0;
  for (const Tool& tool : builtin_tools()) {
    if (!tool.cuts()) continue;
    for (const bool open_behind : {false, true}) {
      const CutShape shape(tool, open_behind);
      Sweep sweep;
      sweep.shape = &shape;
      sweep.from = {{0.3, -0.2, 4.0}, Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vec3(1, 2, 3).normalized()))};
      sweep.reach({sweep.from.position_mm + Vec3(0.4, 0.1, 0.7), sweep.from.rotation});
      const Pose now{sweep.to.position_mm + Vec3(0.05, 0.02, -0.1), sweep.to.rotation};
      const SweepView view(sweep, nullptr, now, 0.1);
      double most_off = 0.0;
      for (int round = 0; round < 50; ++round) {
        Lanes p[3], left;
        Parts by;
        for (std::size_t i = 0; i < kGroupPoints; ++i) {
          p[0][i] = static_cast<float>(12.0 * even(random));
          p[1][i] = static_cast<float>(12.0 * even(random));
          p[2][i] = static_cast<float>(15.0 * even(random) - 10.0);
        }
        const Lanes distance = shape.distance_mm(HullPlace{}, p);
        for (const int lanes : {4, 8}) {
          limit_contact_lanes(lanes);
          EXPECT_EQ(shape.distance_mm(HullPlace{}, p), distance) << tool.name << ", " << lanes << " at a time";
        }
        limit_contact_lanes(16);
        view.left_mm(p, left, by);
        for (std::size_t i = 0; i < kGroupPoints; ++i) {
          const Vec3 at(p[0][i], p[1][i], p[2][i]);
          most_off = std::max(most_off, std::abs(shape.distance_mm(at) - static_cast<double>(distance[i])));
          EXPECT_NEAR(view.way_out(at, by[i]).norm(), 1.0, 1e-4);
          // It has taken the bone away where it was at either end.
          const Vec3 bone = now.point(at);
          double deepest = std::min(shape.distance_mm(sweep.to.inverse().point(bone)), 1e6);
          if (open_behind && !shape.is_ball()) continue;
          deepest = std::min(deepest, shape.distance_mm(sweep.from.inverse().point(bone)));
          EXPECT_GT(static_cast<double>(left[i]), -deepest - 1e-4) << tool.name;
        }
      }
      EXPECT_LT(most_off, 5e-5) << tool.name;
      ++tried;
    }
  }
  EXPECT_GE(tried, 40);
}

// A sweep that begins where the one before visibly ends leaves out that position. Both together leave what they left
// before.
TEST(SweepView, LeavesOutOnlyWhatTheOneBeforeShows) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const CutShape shape(*find_tool("saw-oscillating-1"), false);
  Sweep first, second;
  first.shape = second.shape = &shape;
  first.from = {{0.0, 0.0, 4.0}, Eigen::Quaterniond::Identity()};
  first.reach({{0.5, 0.0, 4.3}, Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vec3::UnitX()))});
  second.from = first.to;
  second.reach({{-0.4, 0.2, 5.2}, Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vec3::UnitY()))});
  Sweep elsewhere = second;  // begins a little off the end of the first
  elsewhere.from.position_mm.x() += 0.5;
  const Pose now = second.to;
  const SweepView before(first, nullptr, now, 0.1), alone(second, nullptr, now, 0.1), after(second, &first, now, 0.1);
  const SweepView off(elsewhere, &first, now, 0.1), off_alone(elsewhere, nullptr, now, 0.1);
  int lent = 0;
  for (int round = 0; round < 200; ++round) {
    Lanes p[3], of_before, of_alone, of_after, of_off, of_off_alone;
    Parts by;
    for (Lanes& axis : p)
      for (float& x : axis) x = static_cast<float>(6.0 * even(random));
    before.left_mm(p, of_before, by);
    alone.left_mm(p, of_alone, by);
    after.left_mm(p, of_after, by);
    off.left_mm(p, of_off, by);
    off_alone.left_mm(p, of_off_alone, by);
    EXPECT_EQ(of_off, of_off_alone);
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      EXPECT_EQ(std::max(of_before[i], of_after[i]), std::max(of_before[i], of_alone[i]));
      lent += of_after[i] < of_alone[i];
    }
  }
  EXPECT_GT(lent, 50);  // otherwise the test would prove nothing
}

}  // namespace
}  // namespace osteon::haptic::test
