#include "viewer_client/scene/stroke.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace osteon {
namespace {

TEST(Stroke, AStraightLineIsItsEnds) {
  Stroke stroke;
  for (int i = 0; i <= 400; ++i) stroke.add(Vec3(0.1 * i, 0, 0));
  const auto line = stroke.line(1024);
  ASSERT_EQ(line.size(), 2u);
  EXPECT_EQ(line.front(), Vec3::Zero());
  EXPECT_NEAR(line.back().x(), 40.0, 1e-9) << "the point of release, however near to the point before";
}

TEST(Stroke, PointsAreAMillimetreApartAndKeepTheirCorners) {
  Stroke stroke;
  for (int i = 0; i <= 1000; ++i) stroke.add(Vec3(0.01 * i, 0, 0));
  for (int i = 1; i <= 1000; ++i) stroke.add(Vec3(10, 0.01 * i, 0));
  const auto line = stroke.line(1024);
  ASSERT_EQ(line.size(), 3u);
  EXPECT_LT((line[1] - Vec3(10, 0, 0)).norm(), Stroke::kApart_mm);
}

TEST(Stroke, KeepsTheTurnOfAHandThatComesBackOnItsOwnLine) {
  Stroke stroke;
  for (int i = 0; i <= 300; ++i) stroke.add(Vec3(0.1 * i, 0, 0));
  for (int i = 300; i >= 200; --i) stroke.add(Vec3(0.1 * i, 0, 0));
  const auto line = stroke.line(1024);
  ASSERT_EQ(line.size(), 3u);
  EXPECT_NEAR(line[1].x(), 30.0, Stroke::kApart_mm) << "beyond both ends";
  EXPECT_NEAR(line[2].x(), 20.0, 1e-9);
}

TEST(Stroke, ACircleIsPassedWithinTheToleranceAndOnlyAsFinelyAsAllowed) {
  Stroke stroke;
  const double radius_mm = 20.0;
  const auto at = [&](double turn) {
    return Vec3(radius_mm * std::cos(2 * std::numbers::pi * turn), radius_mm * std::sin(2 * std::numbers::pi * turn),
                0);
  };
  for (int i = 0; i < 3000; ++i) stroke.add(at(i / 3000.0));
  const auto fine = stroke.line(1024), coarse = stroke.line(12);
  EXPECT_LE(coarse.size(), 12u);
  EXPECT_GE(coarse.size(), 5u);
  EXPECT_GT(fine.size(), coarse.size());
  EXPECT_LT(fine.size(), 126u) << "2 pi r points a millimetre apart";
  // A chord whose middle is s inside the circle spans an angle of 2 acos(1 - s / r). Here s is 0.05 mm plus the
  // millimetre's share.
  for (std::size_t i = 1; i < fine.size(); ++i)
    EXPECT_GT(0.5 * (fine[i - 1] + fine[i]).norm(), radius_mm - 0.05 - 1.0 / (8.0 * radius_mm)) << i;
  EXPECT_EQ(fine.front(), coarse.front());
  EXPECT_EQ(fine.back(), coarse.back());
}

TEST(Stroke, AHandThatDoesNotMoveDrawsNothing) {
  Stroke stroke;
  EXPECT_TRUE(stroke.line(1024).empty());
  stroke.add(Vec3(1, 2, 3));
  stroke.add(Vec3(1, 2, 3));
  EXPECT_TRUE(stroke.line(1024).empty());
  stroke.add(Vec3(1, 2, 3.5));
  EXPECT_EQ(stroke.line(1024).size(), 2u);
}

}  // namespace
}  // namespace osteon
