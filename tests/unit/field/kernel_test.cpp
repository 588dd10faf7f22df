#include "common/field/kernel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "common/field/field_hash.hpp"
#include "tests/support/trials.hpp"

namespace osteon {
namespace {

constexpr double kPitch = 0.5;
constexpr double kFine = 0.125;  // pitch of level 2

// Bodies of this test's own, so that the kernel's results do not depend on the tool box.
std::int32_t q(double mm) { return static_cast<std::int32_t>(std::lround(mm / kQuantum_mm)); }

CutBody ball(double radius) {
  CutBody body;
  body.kind = CutKind::ball;
  body.radius = q(radius);
  body.lowest = {-q(radius), -q(radius), -2 * q(radius)};
  body.highest = {q(radius), q(radius), 0};
  return body;
}

CutBody turned(const std::vector<std::array<double, 2>>& corners, double dome = 0.0) {
  CutBody body;
  body.kind = CutKind::turned;
  body.dome = q(dome);
  double widest = 0.0, bottom = 0.0;
  for (const auto& [r, z] : corners) {
    body.profile.push_back({q(r), q(z)});
    widest = std::max(widest, r);
    bottom = std::min(bottom, z);
  }
  body.lowest = {-q(widest), -q(widest), q(bottom)};
  body.highest = {q(widest), q(widest), 0};
  return body;
}

CutBody drill() { return turned({{0, 0}, {0, -2.6}, {1.6, -2.6}, {1.6, -1.0}}); }
CutBody barrel() { return turned({{0, 0}, {0, -4}, {1.5, -4}, {2.0, -3}, {2.2, -2}, {2.0, -1}, {1.5, 0}}); }
CutBody hemisphere() { return turned({{0, 0}, {0, -4}, {4, -4}, {4, 0}}, 4.0); }
CutBody hollow_mill() { return turned({{2.0, 0}, {2.0, -3}, {3.0, -3}, {3.0, 0}}); }

HullPlane plane(const Vec3& normal, double offset_mm) {
  HullPlane p;
  const Vec3 n = normal.normalized() * 32767.0;
  for (std::size_t k = 0; k < 3; ++k) p.normal[k] = static_cast<std::int16_t>(std::lround(n[static_cast<int>(k)]));
  p.offset = q(offset_mm);
  return p;
}

CutBody box_hull(const Vec3& lowest, const Vec3& highest) {
  CutBody body;
  body.kind = CutKind::hull;
  for (int k = 0; k < 3; ++k) {
    body.planes.push_back(plane(Vec3::Unit(k), highest[k]));
    body.planes.push_back(plane(-Vec3::Unit(k), -lowest[k]));
    body.lowest[static_cast<std::size_t>(k)] = q(lowest[k]);
    body.highest[static_cast<std::size_t>(k)] = q(highest[k]);
  }
  return body;
}
CutBody blade() { return box_hull({-4, -0.4, -3}, {4, 0.4, 0}); }
CutBody wedge() {  // a tapered stem with chamfers
  CutBody body = box_hull({-2, -1.5, -5}, {2, 1.5, 0});
  for (const double side : {-1.0, 1.0}) {
    body.planes.push_back(plane({side, 0, 0.2}, 1.2));
    body.planes.push_back(plane({0, side, 0.15}, 1.0));
    body.planes.push_back(plane({side, 1, 0.1}, 1.5));
    body.planes.push_back(plane({side, -1, 0.1}, 1.5));
  }
  return body;
}

CutBody sampled_ball(double radius, double pitch) {
  const auto n = static_cast<std::int32_t>(std::ceil((radius + 1.0) / pitch));
  const auto middle = static_cast<std::int32_t>(std::lround(-radius / pitch));
  auto lattice = std::make_shared<SampledDistance>();
  lattice->pitch = q(pitch);
  lattice->box = {{-n, -n, middle - n}, {n, n, middle + n}};
  for (std::int32_t x = -n; x <= n; ++x)
    for (std::int32_t y = -n; y <= n; ++y)
      for (std::int32_t z = middle - n; z <= middle + n; ++z)
        lattice->values.push_back(
            static_cast<std::int16_t>(q((Vec3(x, y, z) * pitch + Vec3(0, 0, radius)).norm() - radius)));
  CutBody body = ball(radius);
  body.kind = CutKind::sampled;
  body.radius = 0;
  body.sampled = lattice;
  return body;
}

// Distance to a body at rest, from its definition, in doubles.
double distance_to(const CutBody& body, const Vec3& p) {
  const auto mm = [](std::int32_t quanta) { return quanta * kQuantum_mm; };
  const auto ball_at_tip = [&](double radius) { return (p + Vec3(0, 0, radius)).norm() - radius; };
  if (body.kind == CutKind::ball) return ball_at_tip(mm(body.radius));
  if (body.kind == CutKind::hull) {
    double most = -1e9;
    for (const HullPlane& h : body.planes)
      most = std::max(most, Vec3(h.normal[0], h.normal[1], h.normal[2]).normalized().dot(p) - mm(h.offset));
    return most;
  }
  const double r = std::hypot(p.x(), p.y()), s = p.z();
  double inside = -1e9, outside = 1e9;
  for (std::size_t i = 0; i < body.profile.size(); ++i) {
    const ProfileCorner &a = body.profile[i], &b = body.profile[(i + 1) % body.profile.size()];
    if (a.r == 0 && b.r == 0) continue;
    const double er = mm(b.r - a.r), es = mm(b.z - a.z), length = std::hypot(er, es);
    inside = std::max(inside, ((r - mm(a.r)) * es - (s - mm(a.z)) * er) / length);
    const double t = std::clamp(((r - mm(a.r)) * er + (s - mm(a.z)) * es) / (length * length), 0.0, 1.0);
    outside = std::min(outside, std::hypot(r - mm(a.r) - t * er, s - mm(a.z) - t * es));
  }
  const double outline = inside <= 0.0 ? inside : outside;
  return body.dome > 0 ? std::max(outline, ball_at_tip(mm(body.dome))) : outline;
}

// Another way to compute a sweep's distance: the nearest of many poses between the two ends.
double nearest_pose_distance(const CutBody& body, const Pose& a, const Pose& b, const Vec3& point, int poses) {
  double nearest = 1e9;
  for (int i = 0; i <= poses; ++i) {
    const double t = static_cast<double>(i) / poses;
    const Pose pose{(1.0 - t) * a.position_mm + t * b.position_mm, a.rotation.slerp(t, b.rotation)};
    nearest = std::min(nearest, distance_to(body, pose.inverse().point(point)));
  }
  return nearest;
}

Cut cut_along(std::vector<Pose> path, int level = 2) {
  Cut cut{.author = {1},
          .author_seq = 1,
          .lease_epoch = 1,
          .body = {},
          .tool = {},
          .level = level,
          .path = {},
          .spindle_rpm = 1000};
  for (const Pose& pose : path) cut.path.push_back(quantise(pose));
  return cut;
}

std::vector<Vec3> points_around(const Vec3& centre, double reach, unsigned count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-reach, reach);
  std::vector<Vec3> points;
  for (unsigned i = 0; i < count; ++i) points.push_back(centre + Vec3{offset(random), offset(random), offset(random)});
  return points;
}

// Where the sweep's distance says outside, it must be that of the nearest pose. Inside, the surface of the swept volume
// is at least as far as that of any single pose.
void expect_sweep_matches(const CutBody& body, const Pose& a, const Pose& b, double tolerance_mm,
                          bool exact_inside = false) {
  const SweptTool swept(cut_along({a, b}), body, kPitch);
  const Pose from = dequantise(quantise(a)), to = dequantise(quantise(b));
  const Vec3 middle = 0.5 * (a.point({0, 0, -2}) + b.point({0, 0, -2}));
  int outside = 0, inside = 0;
  for (const Vec3& point : points_around(middle, 5.0, 400, 7)) {
    const double distance = static_cast<double>(swept.distance_mm(point));
    const double nearest = nearest_pose_distance(body, from, to, point, 2000);
    (nearest >= 0.0 ? outside : inside) += 1;
    if (nearest >= 0.0 || exact_inside) {
      ASSERT_NEAR(distance, nearest, tolerance_mm) << point.transpose();
    } else {
      ASSERT_LE(distance, nearest + tolerance_mm) << point.transpose();
    }
  }
  EXPECT_GT(outside, 20);
  EXPECT_GT(inside, 5);
}

// Poses, axes and positions are each rounded to a quantum, and 2000 poses leave a little error.
constexpr double kExact_mm = 4.0 * kQuantum_mm;
// Tolerance of the search for an oblique motion.
constexpr double kSearched_mm = 0.03 * kFine + kExact_mm;

TEST(Kernel, ASphereSweptAlongALineIsACapsule) {
  const Pose a = pose_along({1, 2, 3}, {0, 0, -1}), b = pose_along({9, -2, 5}, {0, 0, -1});
  const SweptTool swept(cut_along({a, b}), ball(2.5), kPitch);
  const Vec3 p0 = a.point({0, 0, -2.5}), p1 = b.point({0, 0, -2.5}), along = p1 - p0;
  for (const Vec3& p : points_around({5, 0, 4}, 8.0, 500, 1)) {
    const double t = std::clamp((p - p0).dot(along) / along.squaredNorm(), 0.0, 1.0);
    ASSERT_NEAR(static_cast<double>(swept.distance_mm(p)), (p - p0 - t * along).norm() - 2.5, kExact_mm);
  }
}

class TurnedSweep : public testing::TestWithParam<CutBody (*)()> {};

TEST_P(TurnedSweep, AlongItsAxisIsExact) {
  const Vec3 axis = Vec3{0.3, -0.2, -1.0}.normalized();
  expect_sweep_matches(GetParam()(), pose_along({0, 0, 0}, axis), pose_along(2.0 * axis, axis), kExact_mm);
  expect_sweep_matches(GetParam()(), pose_along({0, 0, 0}, axis), pose_along(-3.0 * axis, axis), kExact_mm);
}

TEST_P(TurnedSweep, AcrossItsAxisIsExactWithoutScallops) {
  const bool ring = GetParam() == hollow_mill;  // in steps of a quarter pitch, so wrong by half a step
  expect_sweep_matches(GetParam()(), pose_along({0, 0, 0}, {0, 0, -1}), pose_along({4, 2, 0}, {0, 0, -1}),
                       kExact_mm + (ring ? 0.125 * kFine : 0.0), !ring);
}

TEST_P(TurnedSweep, ObliquelyIsWithinTheSearch) {
  const bool ring = GetParam() == hollow_mill;
  const double tolerance = kSearched_mm + (ring ? 0.125 * kFine : 0.0);
  expect_sweep_matches(GetParam()(), pose_along({0, 0, 0}, {0, 0, -1}), pose_along({3, 2, -1}, {0, 0, -1}), tolerance);
  expect_sweep_matches(GetParam()(), pose_along({0, 0, 0}, {0, 0, -1}), pose_along({0.05, 0, -0.2}, {0, 0, -1}),
                       tolerance);
  expect_sweep_matches(GetParam()(), pose_along({0, 0, 0}, {0, 1, -1}), pose_along({-1, 0.5, 1.5}, {0, 1, -1}),
                       tolerance);
}

TEST_P(TurnedSweep, TiltingIsCutAtPosesAQuarterPitchApart) {
  const Pose a = pose_along({0, 0, 0}, {0, 0, -1}), b = pose_along({0.3, 0, -0.1}, {0.08, 0.02, -1});
  expect_sweep_matches(GetParam()(), a, b, 0.25 * kFine + kSearched_mm);
}

INSTANTIATE_TEST_SUITE_P(Bodies, TurnedSweep, testing::Values(drill, barrel, hemisphere, hollow_mill));

TEST(Kernel, ATurnedBodysSpinMovesNothing) {
  const Pose a = pose_along({0, 0, 0}, {0, 0, -1});
  Pose b = a;
  b.rotation = a.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(2.5, Vec3::UnitZ()));
  EXPECT_EQ(SweptTool(cut_along({a, b}), barrel(), kPitch).sweeps().size(), 1u);
  EXPECT_GT(SweptTool(cut_along({a, b}), blade(), kPitch).sweeps().size(), 20u);
}

// The zero surface of a swept hull is that of its poses, and the distance never exceeds the true one. Outside, no
// pose's planes are farther, and the distance grows by no more than the way (below).
TEST(Kernel, AHullSweptIsTheUnionOfItsPoses) {
  for (const CutBody& body : {blade(), wedge()})
    for (const Vec3& way : {Vec3{3, 0, 0}, Vec3{0, 0, -2}, Vec3{0, 1.5, 0}, Vec3{2, 1, -1}, Vec3{-0.1, 0.02, 0.05}}) {
      const Pose a = pose_along({0, 0, 0}, {0.3, 0.1, -1}), b = pose_along(way, {0.3, 0.1, -1});
      const SweptTool swept(cut_along({a, b}), body, kPitch);
      const Pose from = dequantise(quantise(a)), to = dequantise(quantise(b));
      unsigned outside = 0, inside = 0;
      for (const Vec3& point :
           points_around(0.5 * (a.point({0, 0, -2}) + b.point({0, 0, -2})), 4.0, test::trials(600), 3)) {
        const double distance = static_cast<double>(swept.distance_mm(point));
        const double nearest = nearest_pose_distance(body, from, to, point, 1000);
        if (std::abs(nearest) > kExact_mm) {
          ASSERT_EQ(distance > 0.0, nearest > 0.0) << distance << " and " << nearest << " at " << point.transpose();
        }
        if (nearest > 0.0) {
          ASSERT_GE(distance, nearest - kExact_mm);
        } else {
          ASSERT_LE(distance, nearest + kExact_mm);
        }
        ++(nearest > 0.0 ? outside : inside);
      }
      EXPECT_GT(outside, test::trials(50));
      EXPECT_GT(inside, test::trials(5));
    }
}

// Along the blade, across it, and obliquely in its plane: the kerf is as wide as the blade's thickness.
TEST(Kernel, ABladesKerfIsItsThickness) {
  for (const Vec3& way : {Vec3{5, 0, 0}, Vec3{0, 0, -5}, Vec3{3, 0, -4}}) {
    const Pose a = pose_along({0, 0, 0}, {0, 0, -1});
    const Vec3 y = a.direction({0, 1, 0}), x = a.direction({1, 0, 0});
    const Vec3 motion = way.x() * x + way.z() * a.direction({0, 0, -1});
    const SweptTool swept(cut_along({a, {a.position_mm + motion, a.rotation}}), blade(), kPitch);
    const Vec3 middle = a.point({0, 0, -1.5}) + 0.5 * motion;
    for (const double side : {-1.0, 1.0})
      for (const double off : {0.2, 0.4, 0.7})
        EXPECT_NEAR(static_cast<double>(swept.distance_mm(middle + side * off * y)), off - 0.4, kExact_mm);
  }
}

TEST(Kernel, ASampledBallCutsAsABall) {
  const Pose a = pose_along({0, 0, 0}, {0, 0.4, -1}), b = pose_along({1.5, 0.5, -0.5}, {0.1, 0.4, -1});
  const SweptTool exact(cut_along({a, b}), ball(2.0), kPitch),
      sampled(cut_along({a, b}), sampled_ball(2.0, 0.125), kPitch);
  for (const Vec3& p : points_around(a.point({0, 0, -2}), 4.0, 500, 9)) {
    const double ball_mm = static_cast<double>(exact.distance_mm(p)),
                 lattice_mm = static_cast<double>(sampled.distance_mm(p));
    // Half a step of the sub-poses, and the curvature within a cell. Beyond the lattice only a bound is known.
    if (ball_mm > 0.9) {
      ASSERT_LE(lattice_mm, ball_mm + 0.02);
      ASSERT_GE(lattice_mm, 0.85);
    } else if (ball_mm > -1.5) {
      ASSERT_NEAR(lattice_mm, ball_mm, 0.02);
    }
  }
}

struct Motion {
  const char* name;
  CutBody body;
  std::vector<Pose> path;
};

std::vector<Motion> motions() {
  std::vector<Motion> all;
  const Pose a = pose_along({0, 0, 0}, {0.2, 0.1, -1}), near = pose_along({0.1, 0.05, -0.1}, {0.22, 0.1, -1}),
             across = pose_along({3, 1, -0.5}, {0.2, 0.1, -1}),
             deep = pose_along(2.0 * Vec3(0.2, 0.1, -1), {0.2, 0.1, -1});
  for (const auto& [name, body] : {std::pair{"ball", ball(1.6)},
                                   {"drill", drill()},
                                   {"barrel", barrel()},
                                   {"hemisphere", hemisphere()},
                                   {"ring", hollow_mill()},
                                   {"blade", blade()},
                                   {"wedge", wedge()},
                                   {"sampled", sampled_ball(1.5, 0.125)}}) {
    all.push_back({name, body, {a}});
    all.push_back({name, body, {a, near}});
    all.push_back({name, body, {a, deep}});
    all.push_back({name, body, {a, across, near}});
  }
  return all;
}

// Everything that is skipped without evaluation (sweeps, leaves, edges, planes, rows) must not matter.
// A kernel without optimisation takes ten times as long for each leaf. The optimised builds check all of them.
#ifdef OSTEON_KERNEL_IS_SLOW
constexpr unsigned kEveryLeaf = 5;
#else
constexpr unsigned kEveryLeaf = 1;
#endif

TEST(Kernel, WhatIsPassedOverChangesNothing) {
  const auto every = static_cast<std::int32_t>(kEveryLeaf * 4 / test::trials(4));
  for (const Motion& motion : motions()) {
    const SweptTool swept(cut_along(motion.path), motion.body, kPitch);
    const float band = band_mm(kFine);
    const CutPlan plan = swept.plan();
    const auto named = swept.leaves();
    ASSERT_FALSE(named.empty());
    std::mt19937 random(3);
    for (std::int32_t x = -8; x < 8; ++x)
      for (std::int32_t y = -8; y < 8; ++y)
        for (std::int32_t z = -8; z < 8; ++z) {
          if ((x + 3 * y + 9 * z + 104) % every != 0) continue;
          const Coord origin{8 * x, 8 * y, 8 * z};
          std::array<float, kLeafVoxels> values, after_others;
          values.fill(band);
          const bool changed = swept.cut_leaf(origin, values) > 0;
          const bool listed = std::ranges::binary_search(named, origin);
          ASSERT_TRUE(!changed || listed) << motion.name;
          for (int i = 0; i < kLeafVoxels; i += 19) {
            const Vec3 p = position_mm(origin + Coord{i / 64, i / 8 % 8, i % 8}, kFine);
            const float exact = std::clamp(swept.distance_mm(p), -band, band);
            // Beyond the body's box only a bound is known for hulls, and lattices are wrong by their interpolation.
            if (!listed && exact < band) continue;
            ASSERT_NEAR(values[static_cast<std::size_t>(i)], exact, 0.52 * kQuantum_mm)
                << motion.name << ' ' << p.transpose();
          }
          if (!listed) continue;
          // The same after another cut at the same position: the lower of both, whatever the kernel skipped.
          const float level = std::uniform_real_distribution<float>(-band, band)(random);
          after_others.fill(std::round(level * 1024.0f) / 1024.0f);
          const auto before = after_others;
          const auto leaf = std::ranges::find(plan.leaves, origin, &CutPlan::Leaf::origin);
          const LeafChange change = swept.cut_leaf(plan, *leaf, after_others);
          int modified = 0;
          for (std::size_t i = 0; i < before.size(); ++i) {
            ASSERT_EQ(after_others[i], std::min(before[i], values[i])) << motion.name;
            modified += after_others[i] != before[i] ? 1 : 0;
          }
          ASSERT_EQ(change.modified, modified);
          if (modified > 0) {
            ASSERT_EQ(change.removed, std::ranges::all_of(after_others, [&](float v) { return v == -band; }));
          }
        }
  }
}

TEST(Kernel, StoredValuesAreWholeQuantaNeverMinusZeroAndGrowNoFasterThanTheWay) {
  for (const Motion& motion : motions()) {
    const SweptTool swept(cut_along(motion.path), motion.body, kPitch);
    const float band = band_mm(kFine);
    for (const Coord origin : swept.leaves()) {
      std::array<float, kLeafVoxels> values;
      values.fill(band);
      swept.cut_leaf(origin, values);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const float v = values[i];
        ASSERT_EQ(v * 1024.0f, std::round(v * 1024.0f));
        ASSERT_LE(std::abs(v), band);
        ASSERT_NE(std::bit_cast<std::uint32_t>(v), 0x80000000u);
        // Two roundings, and 0.03 pitches of the search on each side.
        const float most = static_cast<float>(kFine * 1.06 + 2.0 * kQuantum_mm);
        if (i % 8 != 7) {
          ASSERT_LE(std::abs(values[i + 1] - v), most) << motion.name;
        }
        if (i / 8 % 8 != 7) {
          ASSERT_LE(std::abs(values[i + 8] - v), most) << motion.name;
        }
        if (i / 64 != 7) {
          ASSERT_LE(std::abs(values[i + 64] - v), most) << motion.name;
        }
      }
    }
  }
}

// A 2 mm burr swung by 20 mm in one cut, with its tip on an arc. The groove's bottom and sides are those of the arc.
TEST(Kernel, AWideSwingLeavesACleanGroove) {
  const double radius = 25.0;
  const double angle = 20.0 / radius;
  std::vector<Pose> path;
  for (int i = 0; i <= 12; ++i) {
    const double t = angle * (static_cast<double>(i) / 12 - 0.5);
    path.push_back(pose_along({radius * std::sin(t), 0, -radius * std::cos(t)}, {std::sin(t), 0, -std::cos(t)}));
  }
  const SweptTool swept(cut_along(path), ball(1.0), kPitch);
  double least = 1e9, most = -1e9;
  for (double t = -0.48 * angle; t <= 0.48 * angle; t += 0.0007) {
    const Vec3 out{std::sin(t), 0, -std::cos(t)};
    const double bottom = static_cast<double>(swept.distance_mm(radius * out));  // the tip's path
    const double side =
        static_cast<double>(swept.distance_mm((radius - 1.0) * out + Vec3(0, 1.0, 0)));  // a radius to the side
    least = std::min({least, bottom, side});
    most = std::max({most, bottom, side});
  }
  // Chords between the knots differ from the arc by l²/8r = 0.014 mm. No other error may be visible.
  const double chord = 20.0 / 12, sagitta = chord * chord / (8.0 * (radius - 1.0));
  EXPECT_LE(most, sagitta + 3.0 * kQuantum_mm);
  EXPECT_GE(least, -3.0 * kQuantum_mm);

  // A straight swing has no chords: the groove is exact to the rounding.
  const SweptTool straight(cut_along({pose_along({-10, 0, 0}, {0, 0, -1}), pose_along({10, 0, 0}, {0, 0, -1})}),
                           ball(1.0), kPitch);
  for (double x = -9.9; x < 9.9; x += 0.013) {
    EXPECT_NEAR(static_cast<double>(straight.distance_mm({x, 0, 0})), 0.0, kQuantum_mm);
    EXPECT_NEAR(static_cast<double>(straight.distance_mm({x, 1.0, 1.0})), 0.0, kQuantum_mm);
  }
}

class CutSet {
 public:
  void apply(const Cut& cut, const CutBody& body) {
    const SweptTool swept(cut, body, kPitch);
    const CutPlan plan = swept.plan();
    for (const CutPlan::Leaf& planned : plan.leaves) {
      auto [leaf, added] = leaves_.try_emplace({cut.level, planned.origin});
      if (added) leaf->second.fill(band_mm(swept.level_pitch_mm()));
      swept.cut_leaf(plan, planned, leaf->second);
    }
  }
  [[nodiscard]] Digest hash() const {
    std::vector<FieldLeaf> leaves;
    for (const auto& [place, values] : leaves_) {
      FieldLeaf leaf{{}, place.first, place.second, {}};
      for (const float v : values) leaf.values.push_back(static_cast<std::int16_t>(std::lround(v * 1024.0f)));
      leaves.push_back(leaf);
    }
    return field_hash(leaves, kPitch);
  }

 private:
  std::map<std::pair<int, Coord>, std::array<float, kLeafVoxels>> leaves_;
};

struct BodyCut {
  Cut cut;
  CutBody body;
};

std::vector<BodyCut> random_cuts(int count) {
  // Only whole numbers are drawn: distributions of reals may differ between libraries.
  std::mt19937 random(11);
  const auto draw = [&](double most) { return most * (static_cast<double>(random() % 2001) / 1000.0 - 1.0); };
  const std::vector<CutBody> bodies{ball(2.5),     drill(), barrel(), hemisphere(),
                                    hollow_mill(), blade(), wedge(),  sampled_ball(1.5, 0.25)};
  std::vector<BodyCut> cuts;
  for (int i = 0; i < count; ++i) {
    const Vec3 axis{draw(1.0), draw(1.0), -1.5}, tip{draw(4.0), draw(4.0), draw(4.0)};
    const Vec3 tilted = axis + 0.02 * Vec3{draw(1.0), draw(1.0), 0.0};
    const Pose from = pose_along(tip, axis);
    const Vec3 way = i % 5 == 0 ? Vec3(draw(1.0) * axis) : Vec3{draw(1.0), draw(1.0), draw(1.0)};
    cuts.push_back({cut_along({from, pose_along(tip + way, i % 4 == 0 ? tilted : axis)}, i % 3),
                    bodies[static_cast<std::size_t>(i) % bodies.size()]});
  }
  return cuts;
}

TEST(Kernel, TheFieldIsAFunctionOfTheSetOfCuts) {
  std::vector<BodyCut> cuts = random_cuts(48);
  CutSet in_order;
  for (const BodyCut& c : cuts) in_order.apply(c.cut, c.body);
  std::mt19937 random(5);
  for (int order = 0; order < 5; ++order) {
    std::ranges::shuffle(cuts, random);
    CutSet shuffled;
    for (const BodyCut& c : cuts) shuffled.apply(c.cut, c.body);
    // some are applied twice
    for (std::size_t i = 0; i < cuts.size(); i += 3) shuffled.apply(cuts[i].cut, cuts[i].body);
    EXPECT_EQ(shuffled.hash(), in_order.hash());
  }
  CutSet fewer;
  for (std::size_t i = 1; i < cuts.size(); ++i) fewer.apply(cuts[i].cut, cuts[i].body);
  EXPECT_NE(fewer.hash(), in_order.hash());
}

// The value was recorded once. gcc and clang, optimised or not, with and without AVX, and every register width that the
// processor has, must all give it. It changes only together with kKernelVersion.
TEST(Kernel, EqualCutsGiveEqualBytesOnEveryCompilerAndProcessor) {
  for (const int lanes : {4, 8, 16}) {
    const int used = limit_kernel_lanes(lanes);
    CutSet set;
    for (const BodyCut& c : random_cuts(96)) set.apply(c.cut, c.body);
    EXPECT_EQ(to_hex(set.hash()), "b286545f018249309d151c5949c4fbeef23aa19a9c713ad60f50f6e8f0e89d94")
        << used << " lanes";
  }
}

TEST(FieldHash, LeavesAtTheBandCountAsAbsent) {
  const auto band = static_cast<std::int16_t>(band_quanta(kPitch));
  const FieldLeaf untouched{{}, 0, {0, 0, 0}, std::vector<std::int16_t>(kLeafVoxels, band)};
  FieldLeaf cut{{}, 0, {8, 0, 0}, std::vector<std::int16_t>(kLeafVoxels, band)};
  cut.values[3] = -5;
  EXPECT_EQ(field_hash({untouched, cut}, kPitch), field_hash({cut}, kPitch));
  FieldLeaf elsewhere = cut;
  elsewhere.origin = {16, 0, 0};
  EXPECT_EQ(field_hash({cut, elsewhere}, kPitch), field_hash({elsewhere, cut}, kPitch));
  EXPECT_NE(field_hash({cut}, kPitch), field_hash({elsewhere}, kPitch));
}

TEST(Cut, OneRotationHasOneSetOfBytes) {
  const Pose pose = pose_along({1, 2, 3}, {0.3, 0.4, -0.8});
  Pose same = pose;
  same.rotation.coeffs() *= -1.0;
  EXPECT_EQ(quantise(same), quantise(pose));
  EXPECT_GE(quantise(same).rotation[3], 0);
}

TEST(Cut, PosesSurviveQuantisationToHalfAQuantum) {
  const Pose pose = pose_along({12.3456, -7.8901, 100.0}, {0.3, 0.4, -0.8});
  const Pose back = dequantise(quantise(pose));
  EXPECT_LE((back.position_mm - pose.position_mm).cwiseAbs().maxCoeff(), 0.5 * kQuantum_mm + 1e-12);
  EXPECT_LT(back.rotation.angularDistance(pose.rotation), 1e-4);
}

}  // namespace
}  // namespace osteon
