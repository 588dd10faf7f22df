#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/lattice.hpp"
#include "common/geometry/pose.hpp"

namespace osteon {
namespace {

TEST(Pose, InverseUndoesAndProductsChain) {
  const Pose a = pose_along({1, 2, 3}, {1, 1, 0}), b = pose_along({-4, 0, 2}, {0, -1, 3});
  const Vec3 p{0.3, -5.0, 2.0};
  EXPECT_LT((a.inverse().point(a.point(p)) - p).norm(), 1e-12);
  EXPECT_LT(((a * b).point(p) - a.point(b.point(p))).norm(), 1e-12);
}

TEST(Pose, AlongPutsTheTipAndPointsTheAxis) {
  for (const Vec3& axis : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{3, -4, 12}}) {
    const Pose pose = pose_along({7, 8, 9}, axis);
    EXPECT_LT((pose.point(Vec3::Zero()) - Vec3(7, 8, 9)).norm(), 1e-12);
    EXPECT_LT((pose.direction(Vec3::UnitZ()) - axis.normalized()).norm(), 1e-12);
  }
}

TEST(Pose, ARotationBetweenTwoDirectionsIsTheShortest) {
  const Vec3 from{3, -4, 12};
  for (const Vec3& to : {Vec3{1, 0, 0}, Vec3{-3, 4, -12}, Vec3{6, -8, 24}}) {
    const Eigen::Quaterniond turn = rotation_between(from, to);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-12);
    const double angle = std::acos(std::clamp(from.normalized().dot(to.normalized()), -1.0, 1.0));
    EXPECT_NEAR(Eigen::AngleAxisd(turn).angle(), angle, 1e-7);
  }
}

TEST(Lattice, RoundsTowardsMinusInfinity) {
  EXPECT_EQ(floor_to({-1, 7, 8}, 8), (Coord{-8, 0, 8}));
  EXPECT_EQ(shift_down({-1, 7, 8}, 2), (Coord{-1, 1, 2}));
}

TEST(Lattice, SamplesCoverTheBox) {
  const CoordBox box = covering_samples({{-0.6, 0.0, 0.9}, {0.4, 1.0, 1.1}}, 0.5);
  EXPECT_EQ(box.min, (Coord{-2, 0, 1}));
  EXPECT_EQ(box.max, (Coord{1, 2, 3}));
  EXPECT_TRUE(covering_samples(Box{}, 0.5).empty());
}

TEST(Lattice, LevelsHalveThePitch) {
  EXPECT_DOUBLE_EQ(level_pitch_mm(0.9, 2), 0.225);
  // A sample of level 0 is a sample of every finer level.
  EXPECT_EQ(position_mm({3, -5, 7}, 0.9), position_mm({12, -20, 28}, level_pitch_mm(0.9, 2)));
}

TEST(Lattice, NoCutIsKeptFinerThanATenthOfAMillimetre) {
  EXPECT_EQ(finest_level(0.957), 2);
  EXPECT_EQ(finest_level(0.4), 2);
  EXPECT_EQ(finest_level(0.25), 1);
  EXPECT_EQ(finest_level(0.19), 0);
  EXPECT_EQ(finest_level(0.05), 0);
}

}  // namespace
}  // namespace osteon
