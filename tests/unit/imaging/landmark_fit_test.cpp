// Rigid fits of landmarks: exact ones, the closed form's independence of order, and points that nothing can be told of.
#include "common/imaging/landmark_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace osteon::imaging {
namespace {

Pose landmark_motion(double degrees, const Vec3& axis, const Vec3& shift) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()))};
}

const Pose kLandmarkTruth = landmark_motion(130.0, {1, -2, 0.5}, {40, -7, 300});

// Corners of a knee, about: not in a plane.
std::vector<LandmarkPair> exact_pairs() {
  std::vector<LandmarkPair> pairs;
  for (const Vec3& at : {Vec3(0, 0, 0), Vec3(60, 5, -8), Vec3(12, 44, 3), Vec3(-20, 15, 71), Vec3(33, -9, 40)})
    pairs.push_back({kLandmarkTruth.point(at), at});
  return pairs;
}

double fit_error_degrees(const Pose& a, const Pose& b) {
  return a.rotation.angularDistance(b.rotation) * 180.0 / std::numbers::pi;
}

void expect_refused(const std::vector<LandmarkPair>& pairs, const std::string& why) {
  const auto fit = fit_landmarks(pairs);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().code, ErrorCode::invalid_input);
  EXPECT_NE(fit.error().message.find(why), std::string::npos) << fit.error().message;
}

TEST(LandmarkFit, ExactPairsGiveTheirMotion) {
  for (const std::size_t count : {3, 4, 5}) {
    auto pairs = exact_pairs();
    pairs.resize(count);
    const auto fit = fit_landmarks(pairs);
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_LT(fit_error_degrees(fit->pose_fixed_moving, kLandmarkTruth), 1e-5);
    EXPECT_LT((fit->pose_fixed_moving.position_mm - kLandmarkTruth.position_mm).norm(), 1e-9);
    ASSERT_EQ(fit->residuals_mm.size(), count);
    EXPECT_LT(std::ranges::max(fit->residuals_mm), 1e-9);
    EXPECT_FALSE(fit->outlier);
  }
}

TEST(LandmarkFit, TheOrderOfPairsDoesNotMatter) {
  auto pairs = exact_pairs();
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].fixed_mm[static_cast<int>(i % 3)] += i % 2 == 0 ? 1.9 : -1.3;
  const auto fit = fit_landmarks(pairs);
  ASSERT_TRUE(fit);
  EXPECT_GT(fit->rms_mm, 0.5);
  for (int turn = 0; turn < 5; ++turn) {
    std::ranges::rotate(pairs, pairs.begin() + 1);
    const auto again = fit_landmarks(pairs);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->pose_fixed_moving.position_mm, fit->pose_fixed_moving.position_mm);
    EXPECT_EQ(again->pose_fixed_moving.rotation.coeffs(), fit->pose_fixed_moving.rotation.coeffs());
    EXPECT_EQ(again->residuals_mm.front(), fit->residuals_mm[static_cast<std::size_t>(turn + 1) % 5]);
  }
}

// The fit balances: residual vectors of a least squares fit sum up to zero, and so do their moments.
TEST(LandmarkFit, ResidualsBalance) {
  auto pairs = exact_pairs();
  pairs[1].fixed_mm.x() += 2.0;
  pairs[3].fixed_mm.z() -= 1.5;
  const auto fit = fit_landmarks(pairs);
  ASSERT_TRUE(fit);
  Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
  for (const LandmarkPair& pair : pairs) {
    const Vec3 at = fit->pose_fixed_moving.point(pair.moving_mm), residual = pair.fixed_mm - at;
    sum += residual;
    moment += at.cross(residual);
  }
  EXPECT_LT(sum.norm(), 1e-9);
  EXPECT_LT(moment.norm(), 1e-7);
}

TEST(LandmarkFit, AWrongPairIsNamed) {
  auto pairs = exact_pairs();
  pairs[2].moving_mm += Vec3(0, 25, 0);
  const auto fit = fit_landmarks(pairs);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_EQ(fit->outlier, std::optional<std::size_t>(2));
  EXPECT_NEAR(fit->outlier_mm, 25.0, 1e-9) << "the others are exact";
}

TEST(LandmarkFit, FewerThanThreeOrALineAreRefused) {
  auto pairs = exact_pairs();
  expect_refused({pairs.begin(), pairs.begin() + 2}, "there are 2 landmarks; give at least 3");
  std::vector<LandmarkPair> line;
  for (const double along : {0.0, 10.0, 35.0, 80.0}) {
    const Vec3 at = Vec3(1, 2, 3) + along * Vec3(2, -1, 0.5).normalized();
    line.push_back({kLandmarkTruth.point(at), at});
  }
  expect_refused(line, "of the fixed scan lie on a line");
  line[2].fixed_mm += Vec3(0, 30, 30);
  expect_refused(line, "of the moving scan lie on a line");
  line[2].moving_mm += Vec3(0.4, 0.4, 0.4);
  expect_refused(line, "of the moving scan lie on a line");
}

TEST(LandmarkFit, AMirroredScanIsRefused) {
  auto pairs = exact_pairs();
  for (LandmarkPair& pair : pairs) pair.moving_mm.y() = -pair.moving_mm.y();
  expect_refused(pairs, "if one scan is mirrored");
}

}  // namespace
}  // namespace osteon::imaging
