// Registration by mutual information, against motions that are known because the test makes both scans from one body.
#include "common/imaging/rigid_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "common/imaging/landmark_fit.hpp"

namespace osteon::imaging {
namespace {

bool never_stop(double) { return true; }

Pose turned(double degrees, const Vec3& axis, const Vec3& shift = Vec3::Zero()) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()))};
}

// 48 x 40 x 32 voxels, turned, of unequal edges; about 58 x 48 x 48 mm around (30, -20, 100).
HuVolume small_grid() {
  HuVolume grid;
  grid.dims = {48, 40, 32};
  grid.spacing_mm = {1.2, 1.2, 1.5};
  grid.directions = turned(25.0, {0.3, 1.0, -0.2}).rotation.toRotationMatrix();
  grid.origin_mm = Vec3(30, -20, 100) - grid.directions * grid.spacing_mm.cwiseProduct(Vec3(23.5, 19.5, 15.5));
  return grid;
}
constexpr double kHalfVoxel_mm = 0.6;

// A bone in soft tissue in air, without any symmetry: a bent shaft with a head and a canal. HU at a position.
double body_hu(const Vec3& at) {
  const auto step = [](double outside_mm) { return 0.5 - 0.5 * std::tanh(outside_mm / 0.8); };
  const Vec3 p = at - Vec3(30, -20, 100);
  const double bend = 0.02 * p.z() * p.z() - 3.0;
  const double flesh = step(std::hypot((p.x() - 1.0) / 1.2, p.y()) - 19.0);
  const double shaft = step(std::hypot(p.x() - bend, p.y() + 2.0) - (5.0 + 0.08 * p.z()));
  const double head = step((p - Vec3(9.0, 3.0, 15.0)).norm() - 7.0);
  const double canal = step(std::hypot(p.x() - bend, p.y() + 2.0) - 2.2);
  const double knob = step((p - Vec3(-8.0, 6.0, -11.0)).norm() - 3.5);
  const double bone = std::max({shaft, head, knob});
  return -1000.0 + flesh * 1050.0 + bone * (1100.0 - 900.0 * canal);
}

HuVolume body_scan(HuVolume grid, const std::function<double(const Vec3&)>& hu_at, double noise_hu = 0.0) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, std::max(noise_hu, 1e-9));
  grid.values.resize(grid.count());
  std::size_t i = 0;
  for (int slice = 0; slice < grid.dims[2]; ++slice)
    for (int row = 0; row < grid.dims[1]; ++row)
      for (int column = 0; column < grid.dims[0]; ++column)
        grid.values[i++] = static_cast<std::int16_t>(
            std::lround(hu_at(grid.position_mm(Vec3(column, row, slice))) + (noise_hu > 0 ? noise(random) : 0.0)));
  return grid;
}

// Values as another kind of scan may show them: dark bone, and no line leads from one to the other.
double remapped(double hu) { return 900.0 - 700.0 * std::tanh(hu / 600.0) + 250.0 * std::exp(-hu * hu / 2e4); }

// The body's scan after it was moved: the moving scan seen from the fixed one is `truth`.
HuVolume moved_scan(const Pose& truth, double noise_hu = 0.0) {
  HuVolume grid = small_grid();
  const Vec3 middle = Vec3(30, -20, 100);
  grid.directions = turned(-15.0, {1, 0, 0.4}).rotation.toRotationMatrix();
  grid.origin_mm =
      truth.inverse().point(middle) - grid.directions * grid.spacing_mm.cwiseProduct(Vec3(23.5, 19.5, 15.5));
  return body_scan(
      grid, [&](const Vec3& at) { return remapped(body_hu(truth.point(at))); }, noise_hu);
}

double degrees_between(const Pose& a, const Pose& b) {
  return a.rotation.angularDistance(b.rotation) * 180.0 / std::numbers::pi;
}
// Where the middle of the body comes to lie.
double shift_between_mm(const Pose& found, const Pose& truth) {
  const Vec3 at = truth.inverse().point(Vec3(30, -20, 100));
  return (found.point(at) - truth.point(at)).norm();
}

const Pose kTruth = turned(10.0, {1, 2, -1.5}, {-6, 9, 4});

// Landmarks of the body in both scans, those of the fixed one wrong by 2 mm each.
Pose rough_start(const Pose& truth) {
  std::vector<LandmarkPair> pairs;
  int i = 0;
  for (const Vec3& at : {Vec3(45, -15, 112), Vec3(18, -12, 90), Vec3(30, -28, 95), Vec3(26, -20, 120)})
    pairs.push_back({at + 2.0 * Vec3(i % 2 == 0 ? 1 : -1, i < 2 ? 1 : -1, 0.7 * ++i - 1.5).normalized(),
                     truth.inverse().point(at)});
  const auto fit = fit_landmarks(pairs);
  EXPECT_TRUE(fit);
  return fit->pose_fixed_moving;
}

RigidRegistration registered(const HuVolume& fixed, const HuVolume& moving, const std::vector<Pose>& starts) {
  const auto found = register_rigidly(fixed, moving, starts, never_stop);
  EXPECT_TRUE(found) << found.error().message;
  return found.value_or(RigidRegistration{});
}

TEST(RigidRegistration, FindsAKnownMotionOfAnotherKindOfScan) {
  const HuVolume fixed = body_scan(small_grid(), body_hu, 25.0), moving = moved_scan(kTruth, 20.0);
  const Pose start = rough_start(kTruth);
  EXPECT_GT(shift_between_mm(start, kTruth) + degrees_between(start, kTruth), 1.0) << "a start that is off";
  const RigidRegistration found = registered(fixed, moving, {start});
  EXPECT_LT(degrees_between(found.pose_fixed_moving, kTruth), 0.5);
  EXPECT_LT(shift_between_mm(found.pose_fixed_moving, kTruth), kHalfVoxel_mm);
  EXPECT_TRUE(found.refined);
  EXPECT_GT(found.information, found.information_at_start);
  std::printf("from %.2f degrees, %.2f mm to %.3f degrees, %.3f mm; %.3f to %.3f nat\n", degrees_between(start, kTruth),
              shift_between_mm(start, kTruth), degrees_between(found.pose_fixed_moving, kTruth),
              shift_between_mm(found.pose_fixed_moving, kTruth), found.information_at_start, found.information);
}

TEST(RigidRegistration, FindsAShiftFromNoMotion) {
  const Pose truth{Vec3(5, -4, 4.8), Eigen::Quaterniond::Identity()};  // 8 mm
  const HuVolume fixed = body_scan(small_grid(), body_hu, 25.0);
  const HuVolume moving = body_scan(
      small_grid(), [&](const Vec3& at) { return body_hu(truth.point(at)); }, 20.0);
  const RigidRegistration found = registered(fixed, moving, {Pose{}});
  EXPECT_LT(degrees_between(found.pose_fixed_moving, truth), 0.5);
  EXPECT_LT(shift_between_mm(found.pose_fixed_moving, truth), kHalfVoxel_mm);
  std::printf("%.3f degrees, %.3f mm\n", degrees_between(found.pose_fixed_moving, truth),
              shift_between_mm(found.pose_fixed_moving, truth));
}

TEST(RigidRegistration, LeavesAScanWhereItIs) {
  const HuVolume fixed = body_scan(small_grid(), body_hu);
  const RigidRegistration found = registered(fixed, fixed, {Pose{}});
  EXPECT_LT(degrees_between(found.pose_fixed_moving, Pose{}), 0.1);
  EXPECT_LT(shift_between_mm(found.pose_fixed_moving, Pose{}), 0.1 * kHalfVoxel_mm);
  EXPECT_NEAR(found.overlap, 1.0, 0.05);
}

TEST(RigidRegistration, TakesTheStartThatHasMostInformation) {
  const HuVolume fixed = body_scan(small_grid(), body_hu, 10.0), moving = moved_scan(kTruth, 10.0);
  const Pose far = turned(170.0, {0, 0, 1}) * kTruth, near = rough_start(kTruth);
  const Pose far_kept{Vec3(30, -20, 100) - far.rotation * kTruth.inverse().point(Vec3(30, -20, 100)), far.rotation};
  const RigidRegistration found = registered(fixed, moving, {far_kept, near});
  EXPECT_EQ(found.start, 1u);
  EXPECT_LT(degrees_between(found.pose_fixed_moving, kTruth), 0.5);
}

TEST(RigidRegistration, GivesOneAnswerEachTime) {
  const HuVolume fixed = body_scan(small_grid(), body_hu, 25.0), moving = moved_scan(kTruth, 20.0);
  const RigidRegistration a = registered(fixed, moving, {rough_start(kTruth)});
  const RigidRegistration b = registered(fixed, moving, {rough_start(kTruth)});
  EXPECT_EQ(a.pose_fixed_moving.position_mm, b.pose_fixed_moving.position_mm);
  EXPECT_EQ(a.pose_fixed_moving.rotation.coeffs(), b.pose_fixed_moving.rotation.coeffs());
  EXPECT_EQ(a.information, b.information);
}

// Noise shares nothing with the body: what the search gains there must not count if it leaves the scan for it.
TEST(RigidRegistration, KeepsTheStartOrGainsInformation) {
  const HuVolume fixed = body_scan(small_grid(), body_hu, 25.0);
  const HuVolume moving = body_scan(
      small_grid(), [](const Vec3&) { return 0.0; }, 300.0);
  const RigidRegistration found = registered(fixed, moving, {Pose{}});
  EXPECT_GE(found.information, found.information_at_start);
  EXPECT_GE(found.overlap, 0.5 * found.overlap_at_start);
  if (!found.refined) {
    EXPECT_EQ(found.pose_fixed_moving.position_mm, Vec3::Zero());
  }
  EXPECT_LT(found.information, 0.3);
  std::printf("%.3f to %.3f nat, overlap %.2f to %.2f\n", found.information_at_start, found.information,
              found.overlap_at_start, found.overlap);
}

TEST(RigidRegistration, OverlapIsThatOfTwoBoxes) {
  const HuVolume fixed = small_grid();
  EXPECT_DOUBLE_EQ(overlap_of(fixed, fixed, Pose{}), 1.0);
  // A quarter of its columns away, along the columns.
  const Vec3 away = fixed.directions * Vec3(12 * 1.2, 0, 0);
  EXPECT_NEAR(overlap_of(fixed, fixed, {away, Eigen::Quaterniond::Identity()}), 0.75, 0.03);
  EXPECT_EQ(overlap_of(fixed, fixed, {5.0 * away, Eigen::Quaterniond::Identity()}), 0.0);
}

TEST(RigidRegistration, RefusesScansThatDoNotMeetOrShowNothing) {
  const HuVolume fixed = body_scan(small_grid(), body_hu);
  const std::vector<Pose> apart{{Vec3(0, 0, 500), Eigen::Quaterniond::Identity()}};
  const auto none = register_rigidly(fixed, fixed, apart, never_stop);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("overlap by less than 5 %"), std::string::npos) << none.error().message;
  const HuVolume plain = body_scan(small_grid(), [](const Vec3&) { return 40.0; });
  const auto empty = register_rigidly(fixed, plain, std::vector{Pose{}}, never_stop);
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().message.find("of the moving scan have one value"), std::string::npos)
      << empty.error().message;
}

TEST(RigidRegistration, StopsAtEveryStageAndNeverGoesBack) {
  const HuVolume fixed = body_scan(small_grid(), body_hu, 25.0), moving = moved_scan(kTruth, 20.0);
  const std::vector<Pose> starts{rough_start(kTruth)};
  long calls = 0;
  double last = 0.0;
  ASSERT_TRUE(register_rigidly(fixed, moving, starts, [&](double fraction) {
    EXPECT_GE(fraction, last - 1e-12);
    EXPECT_LE(fraction, 1.0 + 1e-12);
    last = fraction;
    return ++calls > 0;
  }));
  EXPECT_DOUBLE_EQ(last, 1.0);
  for (const double part : {0.0, 0.02, 0.3, 0.5, 0.7, 0.9, 0.999}) {
    long left = static_cast<long>(part * static_cast<double>(calls));
    const auto found = register_rigidly(fixed, moving, starts, [&](double) { return --left >= 0; });
    ASSERT_FALSE(found) << part;
    EXPECT_EQ(found.error().code, ErrorCode::cancelled);
    EXPECT_EQ(left, -1) << "it asks once, and then stops";
  }
}

}  // namespace
}  // namespace osteon::imaging
