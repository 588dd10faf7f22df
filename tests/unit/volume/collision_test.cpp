#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "common/volume/cell_collision.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

constexpr double kPitch_mm = 0.5, kRadius_mm = 9.0;
const Vec3 kCentre{0.13, -0.21, 0.07};

const Case& ball() {
  static const Case bone = test::make_bone(
      {Vec3::Constant(-10.0), Vec3::Constant(10.0)}, kPitch_mm,
      [](const Vec3& p) { return (p - kCentre).norm() - kRadius_mm; }, [](const Vec3&) { return 1.9; });
  return bone;
}

CoordBox whole(int level) {
  return {{-24 << level, -24 << level, -24 << level}, {24 << level, 24 << level, 24 << level}};
}

// Distance between the surface that a query shows and the ball's, in pitches: root mean square and largest, along rays.
struct SurfaceError {
  double rms = 0.0, largest = 0.0;
};
SurfaceError surface_error(const std::function<bool(const Vec3&)>& inside, double pitch) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  SurfaceError error;
  constexpr int kRays = 2000;
  for (int i = 0; i < kRays; ++i) {
    const Vec3 direction = Vec3{normal(random), normal(random), normal(random)}.normalized();
    // From outside to the first contact in small steps, as a tool's point moves.
    double r = kRadius_mm + 2.0 * pitch;
    while (!inside(kCentre + r * direction) && r > kRadius_mm - 2.0 * pitch) r -= 0.01 * pitch;
    const double e = std::abs(r - kRadius_mm) / pitch;
    error.rms += e * e / kRays;
    error.largest = std::max(error.largest, e);
  }
  error.rms = std::sqrt(error.rms);
  return error;
}

TEST(CellCollision, EachRuleIsAsAccurateAsItCanBe) {
  const CutField field(ball(), {});
  const BoneCells cells(field, 0, whole(0));
  const BoneDistance distance(field, 0, whole(0));
  const SurfaceError nearest =
      surface_error([&](const Vec3& p) { return cells.inside(p, MixedCell::nearest); }, kPitch_mm);
  const SurfaceError trilinear =
      surface_error([&](const Vec3& p) { return cells.inside(p, MixedCell::trilinear); }, kPitch_mm);
  const SurfaceError by_distance = surface_error([&](const Vec3& p) { return distance.inside(p); }, kPitch_mm);
  std::printf("error in pitches, rms / largest: nearest %.3f / %.3f, trilinear %.3f / %.3f, distance %.4f / %.4f\n",
              nearest.rms, nearest.largest, trilinear.rms, trilinear.largest, by_distance.rms, by_distance.largest);
  // A sample stands for a cube. It can be wrong by half the cube's diagonal at most. The rms is at least a quarter of
  // an edge, for values evenly spread over half an edge to both sides and for faces along the lattice.
  EXPECT_LE(nearest.largest, 0.5 * std::sqrt(3.0) + 0.02);
  EXPECT_GT(nearest.largest, 0.4);
  EXPECT_LT(trilinear.rms, nearest.rms);
  EXPECT_LE(trilinear.largest, 0.5 * std::sqrt(3.0) + 0.02);
  // Trilinear distance differs from a sphere only by its curvature, 3 pitch² / (8 radius), and by the quantum of S.
  EXPECT_LE(by_distance.largest, 3.0 * kPitch_mm / (8.0 * kRadius_mm) + kQuantum_mm / kPitch_mm + 0.011);
}

TEST(CellCollision, ACellOfOneKindNeedsNoRule) {
  const CutField field(ball(), {});
  const BoneCells cells(field, 0, whole(0));
  for (const MixedCell rule : {MixedCell::nearest, MixedCell::trilinear}) {
    EXPECT_TRUE(cells.inside(kCentre, rule));
    EXPECT_FALSE(cells.inside({9.9, 9.9, 9.9}, rule));
    EXPECT_FALSE(cells.inside({100.0, 0.0, 0.0}, rule));  // no cell
    EXPECT_FALSE(cells.inside({std::nan(""), 0.0, 0.0}, rule));
  }
}

TEST(CellCollision, SeesWhatWasCut) {
  CutField field(ball(), {});
  BoneCells cells(field, 1, whole(1));
  const Vec3 at = kCentre + Vec3{0, 0, 7.0};
  EXPECT_TRUE(cells.inside(at, MixedCell::trilinear));
  Cut cut = test::straight_cut(*find_tool("burr-round-5"), at - Vec3{0, 0, 2.5}, at - Vec3{0, 0, 2.5}, {0, 0, -1});
  cut.level = 1;
  const CutReport report = field.apply(cut);
  for (const Coord leaf : report.changed_leaves) cells.update(field, {leaf, leaf + Coord{7, 7, 7}});
  EXPECT_FALSE(cells.inside(at, MixedCell::trilinear));
  EXPECT_FALSE(cells.inside(at, MixedCell::nearest));
  // An update gives the same cells as making them anew.
  const BoneCells anew(field, 1, whole(1));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-10.0, 10.0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p{any(random), any(random), any(random)};
    ASSERT_EQ(cells.inside(p, MixedCell::trilinear), anew.inside(p, MixedCell::trilinear));
  }
}

TEST(CellCollision, TheFirstPointOfAToolThatMeetsBone) {
  const CutField field(ball(), {});
  const BoneCells cells(field, 0, whole(0));
  const BoneDistance distance(field, 0, whole(0));
  const auto points = sample_points(*find_tool("burr-round-5"), 200);
  const auto pose = [](double height) {
    Pose p;
    p.position_mm = kCentre + Vec3{0, 0, height};
    p.rotation = Eigen::Quaterniond(0, 1, 0, 0);  // pointing down at the ball
    return p;
  };
  for (const MixedCell rule : {MixedCell::nearest, MixedCell::trilinear}) {
    EXPECT_FALSE(first_contact(cells, rule, points, pose(kRadius_mm + kPitch_mm)));
    const auto hit = first_contact(cells, rule, points, pose(kRadius_mm - kPitch_mm));
    ASSERT_TRUE(hit);
    // Only the end of the bur can be in the bone.
    EXPECT_LT((pose(kRadius_mm - kPitch_mm).rotation * points[*hit].position_mm).z(), 1.0);
  }
  EXPECT_FALSE(first_contact(distance, points, pose(kRadius_mm + 0.05)));
  EXPECT_TRUE(first_contact(distance, points, pose(kRadius_mm - 0.2)));
}

}  // namespace
}  // namespace osteon
