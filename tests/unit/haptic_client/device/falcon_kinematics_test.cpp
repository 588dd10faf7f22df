// The Falcon's geometry: given vectors, forward and inverse kinematics by different ways, and the principle of virtual
// work.
#include "haptic_client/device/falcon_kinematics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <cmath>
#include <numbers>
#include <random>

namespace osteon::haptic {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
const Vector3d kMiddle(0.0, 0.0, kFalconOriginZ_m);

// Positions all over the workspace: 40 mm round its middle, as far as the legs reach.
std::vector<Vector3d> places(int count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> side(-0.040, 0.040);
  std::vector<Vector3d> out;
  while (static_cast<int>(out.size()) < count) {
    const Vector3d offset(side(random), side(random), side(random));
    if (offset.norm() <= 0.040 && falcon_angles(kMiddle + offset)) out.push_back(kMiddle + offset);
  }
  return out;
}

TEST(FalconKinematics, AnglesOfTheGivenPlaces) {
  const auto straight = falcon_angles({0.0, 0.0, 0.12});
  ASSERT_TRUE(straight);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR((*straight)[i] / kDegree, 23.918, 5e-4);
    EXPECT_EQ(std::lround(falcon_counts((*straight)[i])), -304);
  }
  const auto aside = falcon_angles({0.02, 0.01, 0.12});
  ASSERT_TRUE(aside);
  EXPECT_NEAR((*aside)[0] / kDegree, 23.8701, 5e-5);
  EXPECT_NEAR((*aside)[1] / kDegree, 14.8169, 5e-5);
  EXPECT_NEAR((*aside)[2] / kDegree, 38.5990, 5e-5);
}

TEST(FalconKinematics, CountsAreAngles) {
  EXPECT_DOUBLE_EQ(falcon_angle_rad(0) / kDegree, 35.0);
  EXPECT_NEAR(falcon_angle_rad(1000) / kDegree, 35.0 + 36.435, 1e-9);
  EXPECT_NEAR(falcon_counts(falcon_angle_rad(-2345)), -2345.0, 1e-9);
}

// Turned by a third of a turn about z, the three legs stand where their neighbours stood.
TEST(FalconKinematics, ThreefoldSymmetry) {
  const Eigen::Matrix3d third = Eigen::AngleAxisd(120.0 * kDegree, Vector3d::UnitZ()).toRotationMatrix();
  for (const Vector3d& place : places(100)) {
    const auto here = falcon_angles(place), there = falcon_angles(third * place);
    ASSERT_TRUE(here);
    if (!there) continue;
    // Legs at 105, −15 and −135 degrees: a third of a turn brings the second to the first's position.
    EXPECT_NEAR((*there)[0], (*here)[1], 1e-12);
    EXPECT_NEAR((*there)[1], (*here)[2], 1e-12);
    EXPECT_NEAR((*there)[2], (*here)[0], 1e-12);
  }
}

TEST(FalconKinematics, ThereAndBackOverTheWorkspace) {
  double worst_m = 0.0;
  for (const Vector3d& place : places(2000)) {
    const auto angles = falcon_angles(place);
    ASSERT_TRUE(angles);
    const auto back = falcon_place(*angles, kMiddle);
    ASSERT_TRUE(back) << place.transpose();
    worst_m = std::max(worst_m, (*back - place).norm());
  }
  EXPECT_LT(worst_m, 1e-9);
  RecordProperty("worst_nm", std::to_string(1e9 * worst_m));
  std::printf("round trip over the workspace: worst %.2g mm\n", 1e3 * worst_m);
}

// A count of an encoder is a fraction of a millimetre, so rounding to counts costs no more than that.
TEST(FalconKinematics, RoundedCountsKeepThePlace) {
  double worst_mm = 0.0;
  for (const Vector3d& place : places(500)) {
    Vector3d angles = *falcon_angles(place);
    for (int i = 0; i < 3; ++i)
      angles[i] = falcon_angle_rad(static_cast<double>(std::lround(falcon_counts(angles[i]))));
    const auto back = falcon_place(angles, place);
    ASSERT_TRUE(back);
    worst_mm = std::max(worst_mm, 1e3 * (*back - place).norm());
  }
  std::printf("a place from whole counts: worst %.3f mm off\n", worst_mm);
  EXPECT_LT(worst_mm, 0.15);
}

TEST(FalconKinematics, NoPlaceOutOfReach) {
  EXPECT_FALSE(falcon_angles({0.0, 0.0, 0.30}));
  EXPECT_FALSE(falcon_angles({0.15, 0.0, 0.12}));
  EXPECT_FALSE(falcon_place(Vector3d::Constant(std::nan("")), kMiddle));
  EXPECT_FALSE(falcon_place(Vector3d(-60.0, 100.0, 170.0) * kDegree, kMiddle));
}

TEST(FalconKinematics, JacobianIsTheDifferenceQuotient) {
  constexpr double kStep = 1e-6;
  int compared = 0;
  for (const Vector3d& place : places(200)) {
    const auto angles = falcon_angles(place);
    const auto jacobian = falcon_jacobian(*angles, place);
    if (!jacobian || jacobian->norm() > 100.0) continue;  // near stretched legs the quotient is not a measure
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep * Vector3d::Unit(axis);
      const auto ahead = falcon_angles(place + step), behind = falcon_angles(place - step);
      if (!ahead || !behind) continue;
      ++compared;
      EXPECT_LT(((*ahead - *behind) / (2.0 * kStep) - jacobian->col(axis)).norm(), 1e-5 * jacobian->norm());
    }
  }
  EXPECT_GT(compared, 400);
}

// τ·dθ = F·dp for any small move. The angles' change comes from the inverse kinematics alone.
TEST(FalconKinematics, TorquesDoTheWorkOfTheForce) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  double worst = 0.0;
  int compared = 0;
  for (const Vector3d& place : places(300)) {
    const Vector3d angles = *falcon_angles(place);
    const auto jacobian = falcon_jacobian(angles, place);
    if (!jacobian || jacobian->norm() > 100.0) continue;
    const Vector3d force = 5.0 * Vector3d(normal(random), normal(random), normal(random)).normalized();
    const Vector3d torques = falcon_torques(angles, place, force);
    const Vector3d move = 1e-6 * Vector3d(normal(random), normal(random), normal(random)).normalized();
    const auto ahead = falcon_angles(place + move), behind = falcon_angles(place - move);
    if (!ahead || !behind) continue;
    ++compared;
    const double work = force.dot(2.0 * move), by_motors = torques.dot(*ahead - *behind);
    worst = std::max(worst, std::abs(by_motors - work) / (force.norm() * 2.0 * move.norm()));
  }
  EXPECT_GT(compared, 200);
  EXPECT_LT(worst, 1e-5);
  std::printf("virtual work of %d forces: worst difference %.2g of F dp\n", compared, worst);
}

TEST(FalconKinematics, MotorsKeepTheForcesDirectionAtTheirLimit) {
  const Vector3d angles = *falcon_angles(kMiddle);
  const Vector3d force(3.0, -1.0, 2.0);
  const Vector3d torques = falcon_torques(angles, kMiddle, force);
  const FalconCounts small = falcon_motors(torques), large = falcon_motors(10.0 * torques);
  int most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(small[i], std::lround(-1e4 * torques[static_cast<int>(i)]));
    most = std::max(most, std::abs(static_cast<int>(large[i])));
  }
  EXPECT_EQ(most, kFalconMaxMotor);
  const double ratio = static_cast<double>(large[0]) / small[0];
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(large[i], ratio * small[i], 2.0);
  EXPECT_EQ(falcon_motors(Vector3d::Constant(std::nan(""))), FalconCounts{});
}

// No motor's range limits the continuous force that the device promises, in any direction, anywhere in reach.
TEST(FalconKinematics, ContinuousForceIsWithinTheMotorsEverywhere) {
  std::mt19937_64 random(13);
  std::normal_distribution<double> normal;
  double least_n = 1e9, middle_n = 1e9;
  const auto all = places(400);
  for (std::size_t k = 0; k <= all.size(); ++k) {
    const Vector3d place = k < all.size() ? all[k] : kMiddle;
    const Vector3d angles = *falcon_angles(place);
    if (!falcon_jacobian(angles, place)) continue;
    for (int i = 0; i < 100; ++i) {
      const Vector3d direction = Vector3d(normal(random), normal(random), normal(random)).normalized();
      const double n = kFalconMaxMotor / (1e4 * falcon_torques(angles, place, direction).cwiseAbs().maxCoeff());
      least_n = std::min(least_n, n);
      if (k == all.size()) middle_n = std::min(middle_n, n);
    }
  }
  std::printf("force in the worst direction: %.2f N in the middle, %.2f N anywhere within 40 mm\n", middle_n, least_n);
  EXPECT_GT(least_n, 4.5);
}

}  // namespace
}  // namespace osteon::haptic
