// Tests the cutting edge that a tool's contact points find in bone, against closed forms: teeth of a saw, and
// millimetres of the edges of a reamer and a bur.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "haptic_client/contact/patch_builder.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kPi = std::numbers::pi;

// What is in bone ahead of a tool that is pushed along a direction, queried as the proxy does.
struct Met {
  double edge = 0, share = 0;
};
Met met(const Case& bone, const ToolModel& model, const Pose& pose, const Vec3& direction) {
  const CutField field(bone, BodyId{});
  PatchBuilder builder;
  Patch patch;
  builder.build(field, model, pose, patch);
  ContactValues values;
  values.make_room(kMostContactPoints);
  ContactQuery query;
  query.pose_bone_tool = pose;
  query.groups = model.contact.active_groups;
  query.density = query.ahead = true;
  query.direction_bone = direction;
  query.least_facing = model.least_facing;
  query.ahead_mm = model.inset + 0.25 * model.fine_pitch_mm;
  query.most_mm = 2.0 * model.fine_pitch_mm;
  const ContactSums sums = evaluate_contact(patch, model.contact, query, values);
  EXPECT_TRUE(values.covered);
  return {sums.edge, sums.engaged_mm2 / sums.area_mm2};
}

// Bone from z = 0 to 30 where `keep` is negative. `keep` is a distance in mm.
Case cut_out(double half_mm, double pitch_mm, const std::function<double(const Vec3&)>& keep) {
  return osteon::test::make_bone(
      {Vec3(-half_mm - 4, -half_mm - 4, -4), Vec3(half_mm + 4, half_mm + 4, 34)}, pitch_mm,
      [=](const Vec3& p) {
        return std::max({-p.z(), p.z() - 30.0, std::abs(p.x()) - half_mm, std::abs(p.y()) - half_mm, keep(p)});
      },
      [](const Vec3&) { return 1.0; });
}
Case bar(double low_mm, double high_mm) {
  return cut_out(24.0, 0.5, [=](const Vec3& p) { return std::max(low_mm - p.x(), p.x() - high_mm); });
}

// Deep enough for the arc of a blade's tip.
const Pose kTouching{{0, 0, 2.0}, Eigen::Quaterniond::Identity()};

// Teeth per length times the length of the kerf's face. If the blade is over the bone for only a part of its stroke,
// that part counts.
TEST(EngagedEdge, ASawMeetsTheTeethOverTheBone) {
  for (const char* name : {"saw-oscillating-1", "saw-oscillating-2"}) {
    const Tool saw = *find_tool(name);
    const ToolModel model(saw, 0.5);
    const double pitch = saw.width_mm / saw.teeth, reach = saw.pivot_mm * std::sin(0.5 * saw.swing_rad);
    const auto teeth = [&](double low, double high) {
      return met(bar(low, high), model, kTouching, Vec3::UnitZ()).edge;
    };
    // Contact points are half a millimetre apart, so the length of each face is that exact at both ends.
    const double one = 0.5 / pitch;
    EXPECT_NEAR(teeth(-5.0, 5.0), 10.0 / pitch, one) << name;
    EXPECT_NEAR(teeth(-2.5, 2.5), 5.0 / pitch, one) << name;
    EXPECT_NEAR(teeth(-24.0, 24.0), saw.teeth, one) << name;  // all teeth, though the kerf is wider than the blade
    EXPECT_NEAR(teeth(0.0, 24.0), 0.5 * saw.teeth, one) << name;
    // At the end of the stroke: from w/2 outwards, the blade is there for half of the time at first, and for none at
    // its end.
    EXPECT_NEAR(teeth(0.5 * saw.width_mm, 24.0), 0.25 * reach / pitch, one) << name;
    EXPECT_EQ(teeth(0.5 * saw.width_mm + reach + 0.7, 24.0), 0.0) << name;
  }
  const Tool saw = *find_tool("saw-reciprocating");
  const ToolModel model(saw, 0.5);
  // Its toothed edge lies along a bone 8 mm thick, from z = 0 on. It is fed with its edge, along x of the tool.
  const Case plate = cut_out(24.0, 0.5, [](const Vec3& p) { return std::max(p.z() - 8.0, 2.0 - p.x()); });
  const Pose along{{2.0 - 0.5 * saw.width_mm + 0.2, 0, 16.0}, Eigen::Quaterniond::Identity()};
  const double per_mm = saw.teeth / saw.cutting_length_mm;
  EXPECT_NEAR(met(plate, model, along, Vec3::UnitX()).edge, 8.0 * per_mm, 0.5 * per_mm);
}

// Z edges from r to R are Z (R - r) long as seen along the feed, and half of that if half of it is in bone. Over a hole
// of half the radius that is half the edge, though three quarters of the area.
TEST(EngagedEdge, AReamersEdgesGoWithTheRadiusNotTheArea) {
  struct Reamer {
    const char* name;
    double half_mm, pitch_mm, deep_mm;
  };
  for (const Reamer& which : {Reamer{"reamer-cylinder", 12, 0.5, 3.0}, Reamer{"reamer-sphere", 30, 1.0, 25.9}}) {
    const Tool reamer = *find_tool(which.name);
    const ToolModel model(reamer, which.pitch_mm);
    const double radius = 0.5 * reamer.diameter_mm, whole = reamer.teeth * radius, near = 0.04 * whole;
    const Pose pose{{0, 0, which.deep_mm}, Eigen::Quaterniond::Identity()};
    const auto in = [&](const std::function<double(const Vec3&)>& keep) {
      return met(cut_out(which.half_mm, which.pitch_mm, keep), model, pose, Vec3::UnitZ());
    };
    EXPECT_NEAR(in([](const Vec3&) { return -10.0; }).edge, whole, near) << which.name;
    EXPECT_NEAR(in([](const Vec3& p) { return p.x(); }).edge, 0.5 * whole, near) << which.name;
    const Met rim = in([=](const Vec3& p) { return 0.5 * radius - p.head<2>().norm(); });
    EXPECT_NEAR(rim.edge, 0.5 * whole, near) << which.name;
    EXPECT_NEAR(rim.share, 0.75, 0.04) << which.name;
  }
  // A hollow mill has edges only on its ring.
  const Tool ring = *find_tool("reamer-outside");
  const double wall = 0.5 * (ring.diameter_mm - ring.bore_mm);
  const Pose in_bone{{0, 0, 3}, Eigen::Quaterniond::Identity()};
  const Met all =
      met(cut_out(30.0, 1.0, [](const Vec3&) { return -10.0; }), ToolModel(ring, 1.0), in_bone, Vec3::UnitZ());
  EXPECT_NEAR(all.edge, ring.teeth * wall, 0.01 * ring.teeth * wall);
}

// The meridians of a round bur pushed across its axis. Half of them count if it is wholly in bone: Z pi R / 2. Half of
// those count if only one half of it is in bone, square to its axis or along it.
TEST(EngagedEdge, ABursEdgesAreItsMeridians) {
  const Tool burr = *find_tool("burr-round-5");
  const ToolModel model(burr, 0.5, 1.0, 900);
  const double radius = 0.5 * burr.diameter_mm, whole = 0.5 * burr.teeth * kPi * radius;
  const auto edge = [&](double tip_mm, const std::function<double(const Vec3&)>& keep) {
    return met(cut_out(12.0, 0.5, keep), model, {{0, 0, tip_mm}, Eigen::Quaterniond::Identity()}, Vec3::UnitX()).edge;
  };
  const auto all = [](const Vec3&) { return -10.0; };
  EXPECT_NEAR(edge(10.0, all), whole, 0.01 * whole);
  EXPECT_NEAR(edge(10.0, [](const Vec3& p) { return p.y(); }), 0.5 * whole, 0.05 * whole);
  // The half below the surface has its pole. The other half has its shank there, so it is a little less.
  const double lower = edge(radius, all), upper = edge(30.0 + radius, all);
  EXPECT_NEAR(lower + upper, whole, 0.05 * whole);
  EXPECT_NEAR(lower, 0.5 * whole, 0.1 * whole);
}

// A drill's lips are inclined by half the point's angle.
TEST(EngagedEdge, ADrillsLipsAreAsLongAsItsPoint) {
  const Tool drill = *find_tool("drill-3.2");
  const ToolModel model(drill, 0.5);
  const Met whole = met(cut_out(8.0, 0.5, [](const Vec3&) { return -10.0; }), model,
                        {{0, 0, 6}, Eigen::Quaterniond::Identity()}, Vec3::UnitZ());
  EXPECT_NEAR(whole.edge, 2.0 * 1.6 / std::sin(0.5 * drill.point_angle_rad), 0.03);
  EXPECT_NEAR(whole.share, 1.0, 1e-6);
}

}  // namespace
}  // namespace osteon::haptic::test
