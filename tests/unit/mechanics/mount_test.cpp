#include "common/mechanics/mount.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace osteon {
namespace {

constexpr double kPeriod_s = 1.0 / 120.0;

TEST(Mount, RestsWhereLoadAndSpringAreEqual) {
  const MountParams params;
  Mount mount(params);
  const Load load{{10.0, -4.0, 2.0}, {300.0, 0.0, -900.0}};
  for (int i = 0; i < 600; ++i) mount.step(load, kPeriod_s);
  EXPECT_LT((mount.shift().place_mm - load.force_n / params.stiffness_n_per_mm).norm(), 1e-9);
  EXPECT_LT((mount.shift().turn_rad - load.moment_nmm / params.stiffness_nmm_per_rad).norm(), 1e-12);
  const Shift& at = mount.shift();
  EXPECT_NEAR(mount.stored_mj(), 0.5 * load.force_n.dot(at.place_mm) + 0.5 * load.moment_nmm.dot(at.turn_rad), 1e-9);
}

// x(t) = F/K (1 - (1 + w t) e^(-w t)), w² = K/M: the error at a tenth of a second halves with the step.
TEST(Mount, ConvergesToTheCriticallyDampedResponse) {
  MountParams params;
  params.mass_kg = 2.0;
  params.stiffness_n_per_mm = 5.0;
  params.inertia_kg_mm2 = 5000.0;
  params.stiffness_nmm_per_rad = 20000.0;
  const double w = std::sqrt(5.0 / 2e-3), w_turn = std::sqrt(20000.0 / 5.0), t = 0.05;
  const auto response = [t](double rate) { return 1.0 - (1.0 + rate * t) * std::exp(-rate * t); };
  const auto errors = [&](int steps) {
    Mount mount(params);
    for (int i = 0; i < steps; ++i) mount.step({{10, 0, 0}, {0, 0, 2000}}, t / steps);
    return std::pair{std::abs(mount.shift().place_mm.x() - 2.0 * response(w)),
                     std::abs(mount.shift().turn_rad.z() - 0.1 * response(w_turn))};
  };
  auto [place, turn] = errors(50);
  EXPECT_LT(place, 0.02 * 2.0);
  EXPECT_LT(turn, 0.02 * 0.1);
  for (int steps = 100; steps <= 800; steps *= 2) {
    const auto [finer_place, finer_turn] = errors(steps);
    EXPECT_NEAR(place / finer_place, 2.0, 0.1) << steps;
    EXPECT_NEAR(turn / finer_turn, 2.0, 0.1) << steps;
    place = finer_place;
    turn = finer_turn;
  }
}

// Also without a damper, for light and stiff mounts, and against the stops: never more energy than was put in.
TEST(Mount, NeverHasMoreEnergyThanWasPutIn) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto any = [&] { return Vec3(even(random), even(random), even(random)); };
  for (const double mass_kg : {1e-4, 0.1, 5.0})
    for (const double damping : {0.0, 1.0})
      for (const double dt : {1e-4, 1e-3, kPeriod_s, 0.1}) {
        MountParams params;
        params.mass_kg = mass_kg;
        params.inertia_kg_mm2 = 100.0 * mass_kg;
        params.damping = damping;
        params.most_mm = 5.0;
        Mount mount(params);
        double put_in_mj = 0.0;
        Load load;
        for (int i = 0; i < 2000; ++i) {
          if (i % 7 == 0) load = {60.0 * any(), 9000.0 * any()};
          const Shift before = mount.shift();
          mount.step(load, dt);
          put_in_mj += load.force_n.dot(mount.shift().place_mm - before.place_mm) +
                       load.moment_nmm.dot(mount.shift().turn_rad - before.turn_rad);
          ASSERT_LE(mount.stored_mj(), put_in_mj + 1e-6) << mass_kg << ' ' << damping << ' ' << dt << ' ' << i;
          ASSERT_LE(mount.shift().place_mm.norm(), params.most_mm + 1e-9);
          ASSERT_LE(mount.shift().turn_rad.norm(), params.most_rad + 1e-9);
        }
      }
}

TEST(Mount, IsTheSameInAllDirections) {
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(1.1, Vec3(1, 2, -2).normalized()));
  const Load load{{10.0, -4.0, 2.0}, {300.0, 0.0, -900.0}};
  Mount plain{MountParams{}}, other{MountParams{}};
  for (int i = 0; i < 20; ++i) {
    plain.step(load, kPeriod_s);
    other.step({turned * load.force_n, turned * load.moment_nmm}, kPeriod_s);
    EXPECT_LT((other.shift().place_mm - turned * plain.shift().place_mm).norm(), 1e-12);
    EXPECT_LT((other.shift().turn_rad - turned * plain.shift().turn_rad).norm(), 1e-12);
  }
}

TEST(Mount, TurnsTheBoneAboutItsCentre) {
  MountParams params;
  params.centre_mm = {10, 20, 30};
  params.pose_world_rest = {{1, 2, 3}, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3::UnitY()))};
  EXPECT_LT((pose_world_bone(params, {}).position_mm - params.pose_world_rest.position_mm).norm(), 1e-15);
  const Shift shift{{0.5, -1.0, 2.0}, {0, 0, 0.2}};
  const Pose pose = pose_world_bone(params, shift);
  const Vec3 centre_bone_mm = params.pose_world_rest.inverse().point(params.centre_mm);
  EXPECT_LT((pose.point(centre_bone_mm) - params.centre_mm - shift.place_mm).norm(), 1e-12);
  // A point beside the centre along x turns by the angle.
  const Vec3 beside = params.pose_world_rest.inverse().point(params.centre_mm + Vec3(8, 0, 0));
  EXPECT_LT(
      (pose.point(beside) - params.centre_mm - shift.place_mm - 8.0 * Vec3(std::cos(0.2), std::sin(0.2), 0)).norm(),
      1e-12);
}

TEST(Mount, TakesNoBadNumbers) {
  MountParams params;
  EXPECT_TRUE(params.good());
  params.stiffness_n_per_mm = 0.0;
  EXPECT_FALSE(params.good());
  Mount mount{MountParams{}};
  mount.step({{std::nan(""), 0, 0}, Vec3::Zero()}, kPeriod_s);
  EXPECT_TRUE(mount.shift().finite());
}

}  // namespace
}  // namespace osteon
