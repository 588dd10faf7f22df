// Compares the integer bodies that a cut sweeps with the real tools. Plain formulas of this test evaluate the bodies.
#include "common/tools/cut_body.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/tools/tool_file.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

using std::numbers::pi;

// True if a point is in the body: exact, in doubles.
bool in_body(const CutBody& body, const Vec3& p) {
  switch (body.kind) {
    case CutKind::ball: {
      const double radius = body.radius * kQuantum_mm;
      return (p + Vec3(0, 0, radius)).norm() <= radius;
    }
    case CutKind::turned: {
      const double r = std::hypot(p.x(), p.y()), dome = body.dome * kQuantum_mm;
      if (body.dome != 0 && (p + Vec3(0, 0, dome)).norm() > dome) return false;
      for (std::size_t i = 0; i < body.profile.size(); ++i) {
        const ProfileCorner a = body.profile[i], b = body.profile[(i + 1) % body.profile.size()];
        if (a.r == 0 && b.r == 0) continue;
        const double er = b.r - a.r, ez = b.z - a.z;
        if ((r / kQuantum_mm - a.r) * ez - (p.z() / kQuantum_mm - a.z) * er > 0.0) return false;
      }
      return true;
    }
    case CutKind::hull:
      for (const HullPlane& plane : body.planes) {
        const Vec3 n = Vec3(plane.normal[0], plane.normal[1], plane.normal[2]).normalized();
        if (n.dot(p) > plane.offset * kQuantum_mm) return false;
      }
      return true;
    default:
      return false;
  }
}

std::vector<Tool> cutters() {
  std::vector<Tool> all;
  for (const Tool& tool : builtin_tools())
    if (tool.cuts()) all.push_back(tool);
  return all;
}

class EveryCutter : public testing::TestWithParam<Tool> {};

TEST_P(EveryCutter, BodyIsTheCutSolidToTwoQuanta) {
  const Tool& tool = GetParam();
  const CutBody body = tool.cut_body();
  ASSERT_TRUE(body.cuts());
  const Implicit solid = cut_solid(tool);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const Box box = solid.bounds.grown(0.05);
  int inside = 0, near = 0;
  for (int i = 0; i < 60000; ++i) {
    Vec3 p = box.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(box.size_mm());
    // Half of the positions are within a few quanta of the surface, where the two can differ.
    if (i % 2 == 0) p += (std::copysign(3.0 * kQuantum_mm, share(random) - 0.5) - solid(p)) * gradient(solid, p);
    const double distance = solid(p);
    if (std::abs(distance) <= 2.0 * kQuantum_mm) continue;
    near += std::abs(distance) < 4.0 * kQuantum_mm;
    inside += distance < 0.0;
    ASSERT_EQ(in_body(body, p), distance < 0.0) << p.transpose() << " at " << distance / kQuantum_mm << " quanta";
  }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(near, 1000);
}

// The body is the tool's own cutting part, except for the body's end, which lies in what was cut before.
TEST_P(EveryCutter, BodyIsTheToolWhereItHasNoStroke) {
  const Tool& tool = GetParam();
  if (tool.kind == ToolKind::oscillating_saw || tool.kind == ToolKind::reciprocating_saw) return;
  const CutBody body = tool.cut_body();
  const double back = body.lowest[2] * kQuantum_mm, core = 0.5 * tool.core_diameter_mm;
  const Implicit part = cutting_part(tool);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const Box box = part.bounds.grown(0.02);
  int compared = 0;
  for (int i = 0; i < 60000; ++i) {
    Vec3 p = box.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(box.size_mm());
    p.z() = back + (share(random) * 1.02 - 0.01) * -back;
    const double distance = part(p);
    if (std::abs(distance) <= 2.0 * kQuantum_mm || p.z() < back + 2.0 * kQuantum_mm) continue;
    // A screw's hole is its core: the thread presses into bone.
    if (tool.kind == ToolKind::screw && std::hypot(p.x(), p.y()) > core - 2.0 * kQuantum_mm) continue;
    ++compared;
    ASSERT_EQ(in_body(body, p), distance < 0.0) << p.transpose();
  }
  EXPECT_GT(compared, 1000);
}

TEST_P(EveryCutter, BoxOfTheBodyIsTightAndOutwards) {
  const CutBody body = GetParam().cut_body();
  const Box solid = cut_solid(GetParam()).bounds;
  for (int k = 0; k < 3; ++k) {
    const std::size_t i = static_cast<std::size_t>(k);
    EXPECT_NEAR(body.lowest[i] * kQuantum_mm, solid.min_mm[k], 3.0 * kQuantum_mm);
    EXPECT_NEAR(body.highest[i] * kQuantum_mm, solid.max_mm[k], 3.0 * kQuantum_mm);
  }
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const Box box = solid.grown(0.01);
  for (int n = 0; n < 30000; ++n) {
    const Vec3 p = box.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(box.size_mm());
    if (!in_body(body, p)) continue;
    for (int k = 0; k < 3; ++k) {
      const std::size_t i = static_cast<std::size_t>(k);
      ASSERT_GE(p[k], body.lowest[i] * kQuantum_mm);
      ASSERT_LE(p[k], body.highest[i] * kQuantum_mm);
    }
  }
}

TEST_P(EveryCutter, BodyKeepsTheRulesOfItsKind) {
  const CutBody body = GetParam().cut_body();
  EXPECT_LE(body.profile.size(), kMostProfileCorners);
  EXPECT_LE(body.planes.size(), kMostHullPlanes);
  for (std::size_t i = 0; i < body.profile.size(); ++i) {
    const ProfileCorner a = body.profile[i], b = body.profile[(i + 1) % body.profile.size()],
                        c = body.profile[(i + 2) % body.profile.size()];
    EXPECT_GE(a.r, 0);
    // It turns to the left at every corner: convex and counter-clockwise.
    EXPECT_GT(static_cast<std::int64_t>(b.r - a.r) * (c.z - b.z) - static_cast<std::int64_t>(b.z - a.z) * (c.r - b.r),
              0);
  }
  EXPECT_EQ(body, GetParam().cut_body());
}

INSTANTIATE_TEST_SUITE_P(Builtin, EveryCutter, testing::ValuesIn(cutters()), [](const auto& param) {
  std::string name = param.param.name;
  std::ranges::replace_if(
      name, [](char c) { return !std::isalnum(c); }, '_');
  return name;
});

// The blade itself at many angles of its stroke: a strip whose tooth line is an arc about the pivot.
TEST(CutBody, AnOscillatingSawsBodyIsTheUnionOfItsStroke) {
  for (const char* name : {"saw-oscillating-1", "saw-oscillating-2", "saw-oscillating-3"}) {
    const Tool saw = *find_tool(name);
    const CutBody body = saw.cut_body();
    const double pivot = saw.pivot_mm, kerf = saw.thickness_mm + saw.set_mm;
    const auto in_blade = [&](const Vec3& p, double angle, double grown) {
      // Into the blade's own frame, about the pivot.
      const double x = std::cos(angle) * p.x() - std::sin(angle) * (p.z() + pivot);
      const double up = std::sin(angle) * p.x() + std::cos(angle) * (p.z() + pivot);
      return std::abs(x) <= 0.5 * saw.width_mm + grown && std::hypot(x, up) <= pivot + grown &&
             std::abs(p.y()) <= 0.5 * kerf + grown;
    };
    const auto in_stroke = [&](const Vec3& p, double grown) {
      constexpr int kAngles = 200;
      for (int i = 0; i <= kAngles; ++i)
        if (in_blade(p, saw.swing_rad * (static_cast<double>(i) / kAngles - 0.5), grown)) return true;
      return false;
    };
    std::mt19937 random(8);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    const double reach = body.highest[0] * kQuantum_mm;
    // Chords instead of the arc, rounding, and the step between two angles at the corner.
    const double tolerance = 0.010 + 2.0 * kQuantum_mm;
    int inside = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p(1.05 * reach * share(random), 0.55 * kerf * share(random),
                   saw.cutting_length_mm * (0.53 * share(random) - 0.47));
      if (p.z() < -saw.cutting_length_mm + tolerance) continue;
      if (in_stroke(p, -tolerance)) {
        ++inside;
        ASSERT_TRUE(in_body(body, p)) << name << " " << p.transpose();
      }
      if (in_body(body, p)) {
        ASSERT_TRUE(in_stroke(p, tolerance)) << name << " " << p.transpose();
      }
    }
    EXPECT_GT(inside, 5000);
  }
}

TEST(CutBody, AReciprocatingSawsBodyIsItsBladeLongerByTheStroke) {
  const Tool saw = *find_tool("saw-reciprocating");
  const CutBody body = saw.cut_body();
  const double kerf = saw.thickness_mm + saw.set_mm;
  EXPECT_EQ(body.highest, (std::array<std::int32_t, 3>{4096, static_cast<std::int32_t>(512 * kerf), 1536}));
  EXPECT_EQ(body.lowest,
            (std::array<std::int32_t, 3>{-4096, static_cast<std::int32_t>(-512 * kerf), -26 * 1024 - 512}));
}

TEST(CutBody, AKerfIsThePlateAndTheSetOfTheTeeth) {
  for (const Tool& saw : builtin_tools()) {
    if (saw.kind != ToolKind::oscillating_saw && saw.kind != ToolKind::reciprocating_saw) continue;
    const CutBody body = saw.cut_body();
    double low = 0.0, high = 0.0;
    for (double y = 0.0; in_body(body, {0, y, -1}); y += 1e-4) high = y;
    for (double y = 0.0; in_body(body, {0, y, -1}); y -= 1e-4) low = y;
    EXPECT_NEAR(high - low, saw.thickness_mm + saw.set_mm, kQuantum_mm + 2e-4) << saw.name;
    // The plate moves freely in it.
    EXPECT_LT(saw.thickness_mm, high - low);
  }
}

TEST(CutBody, ADrillCutsWithItsLipsAndALand) {
  const Tool drill = *find_tool("drill-3.2");
  const CutBody body = drill.cut_body();
  // (D/2) / tan(59°) = 0.961 mm. force-laws calls it the ramp of the entry.
  EXPECT_NEAR(-body.profile[3].z * kQuantum_mm, 0.961, 0.001);
  EXPECT_EQ(body.profile, (std::vector<ProfileCorner>{{0, 0}, {0, -2622}, {1638, -2622}, {1638, -984}}));
}

TEST(CutBody, ArcsAreWithinTheirChordsShareOfACell) {
  // A surface may be wrong by 0.15 of a cell. Chords take less than two thirds of it at the finest pitch.
  constexpr double kShare_mm = 0.1 * 0.125;
  const Tool barrel = *find_tool("burr-barrel"), contoured = *find_tool("burr-contoured");
  const Implicit barrel_part = cutting_part(barrel), contoured_part = cutting_part(contoured);
  for (int i = 0; i <= 1000; ++i) {
    const double z = -barrel.cutting_length_mm * i / 1000.0, off = z + 0.5 * barrel.cutting_length_mm;
    const double r =
        0.5 * barrel.diameter_mm - barrel.corner_mm + std::sqrt(barrel.corner_mm * barrel.corner_mm - off * off);
    ASSERT_NEAR(barrel_part({r, 0, z}), 0.0, kShare_mm);
    const double end = end_radius_mm(contoured),
                 angle = contoured.taper_rad + (0.5 * pi - contoured.taper_rad) * i / 1000.0;
    ASSERT_NEAR(contoured_part({end * std::cos(angle), 0, end * std::sin(angle) - end}), 0.0, kShare_mm);
  }
  // The taper continues from the rounded end to the full diameter.
  EXPECT_NEAR(contoured_part({0.5 * contoured.diameter_mm, 0, -contoured.cutting_length_mm}), 0.0, 1e-9);
}

TEST(CutBody, WhatDoesNotCutHasNone) {
  for (const Tool& tool : builtin_tools()) EXPECT_EQ(tool.cut_body().cuts(), tool.cuts()) << tool.name;
  EXPECT_FALSE(find_tool("guide-2")->cuts());
  EXPECT_FALSE(find_tool("trial-stem")->cuts());
}

}  // namespace
}  // namespace osteon
