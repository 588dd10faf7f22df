// Many points in one pass must find what each finds alone, for every width of registers. Their sums must agree with
// closed forms.
#include "haptic_client/contact/contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/mechanics/milling.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

constexpr int kAllLanes = 16;

struct Widest {
  ~Widest() { limit_contact_lanes(kAllLanes); }
};

// A block with a drilled hole, and a burr half in it.
class ContactOnBlock : public ::testing::Test {
 protected:
  ContactOnBlock()
      : bone_(block_case(16.0)),
        field_(bone_, BodyId{}),
        model_(*find_tool("burr-round-5"), bone_.pitch_mm(), 1.0, 900) {
    field_.apply(osteon::test::straight_cut(*find_tool("drill-3.2"), {0, 0, -1}, {0, 0, 6}, Vec3::UnitZ()));
    values_.make_room(kMostContactPoints);
  }
  void build(const Pose& pose) { builder_.build(field_, model_, pose, patch_); }
  ContactSums evaluate(ContactQuery query) {
    query.groups = model_.contact.groups();
    return evaluate_contact(patch_, model_.contact, query, values_);
  }
  [[nodiscard]] const ContactPoint& point(int i) const {
    const int first = model_.contact.first_passive();
    return i < first ? model_.active[static_cast<std::size_t>(i)] : model_.passive[static_cast<std::size_t>(i - first)];
  }
  [[nodiscard]] std::vector<int> points() const {
    std::vector<int> all;
    for (int i = 0; i < model_.contact.active; ++i) all.push_back(i);
    for (int i = 0; i < model_.contact.passive; ++i) all.push_back(model_.contact.first_passive() + i);
    return all;
  }

  Case bone_;
  CutField field_;
  ToolModel model_;
  PatchBuilder builder_;
  Patch patch_;
  ContactValues values_;
};

// Distance to the block: 16 mm square, 30 mm deep.
double to_block_mm(const Vec3& p) {
  return Vec3(std::max(0.0, std::abs(p.x()) - 8.0), std::max(0.0, std::abs(p.y()) - 8.0),
              std::max({0.0, -p.z(), p.z() - 30.0}))
      .norm();
}

Pose pose_of(osteon::test::Random& random) {
  const Vec3 tip(random.between(-2, 2), random.between(-2, 2), random.between(-1, 6));
  return {tip, Eigen::Quaterniond(Eigen::AngleAxisd(random.between(-0.6, 0.6), random.direction()))};
}

// Floats relative to a corner of the patch: a hundred-thousandth of a millimetre in position, slopes of about one.
TEST_F(ContactOnBlock, FindsWhatEachPointFindsAlone) {
  osteon::test::Random random(3);
  int near = 0, in_bone = 0, coarse = 0;
  for (int trial = 0; trial < 30; ++trial) {
    ContactQuery query;
    query.pose_bone_tool = pose_of(random);
    query.density = true;
    build(query.pose_bone_tool);
    evaluate(query);
    ASSERT_TRUE(values_.covered);
    for (const int i : points()) {
      const auto at = static_cast<std::size_t>(i);
      const Vec3 p = query.pose_bone_tool.point(point(i).inset_mm);
      double alone = 0.0, unused = 0.0;
      const auto found = static_cast<double>(values_.distance_mm[at]);
      if (!patch_.solid(p, alone)) {
        // Farther from bone than the patch reaches.
        EXPECT_GE(found, query.margin_mm);
        continue;
      }
      if (found > query.margin_mm && found != alone && alone > query.margin_mm) {
        EXPECT_LE(found, to_block_mm(p) + 1e-4);
        continue;
      }
      ++near;
      EXPECT_NEAR(found, alone, 1e-4) << p.transpose();
      coarse += !patch_.fine.sample(p, unused);
      if (found < 0.0) {
        ++in_bone;
        EXPECT_NEAR(static_cast<double>(values_.density_g_cm3[at]), patch_.density_at(p), 1e-4);
      }
      // The gradient of the cell, if the step does not leave the cell.
      const double step = 1e-3;
      const Vec3 gradient(values_.gx[at], values_.gy[at], values_.gz[at]);
      const Vec3 cell = p / model_.fine_pitch_mm, part = cell.array() - cell.array().floor();
      if (part.minCoeff() < 0.02 || part.maxCoeff() > 0.98) continue;
      for (int axis = 0; axis < 3; ++axis) {
        double above = 0.0, below = 0.0;
        ASSERT_TRUE(patch_.solid(p + step * Vec3::Unit(axis), above) &&
                    patch_.solid(p - step * Vec3::Unit(axis), below));
        EXPECT_NEAR(gradient[axis], (above - below) / (2.0 * step), 2e-3);
      }
    }
  }
  EXPECT_GT(near, 10000);
  EXPECT_GT(in_bone, 2000);
  EXPECT_GT(coarse, 1000);
}

TEST_F(ContactOnBlock, EveryWidthGivesTheSameNumbers) {
  const Widest widest;
  osteon::test::Random random(5);
  int widths = 0;
  for (int trial = 0; trial < 10; ++trial) {
    ContactQuery query;
    query.pose_bone_tool = pose_of(random);
    query.density = query.ahead = true;
    query.direction_bone = random.direction();
    query.ahead_mm = 0.1;
    query.most_mm = 0.25;
    query.least_facing = 0.2;
    query.strength = &model_.strength;
    build(query.pose_bone_tool);
    limit_contact_lanes(4);
    const ContactSums narrow = evaluate(query);
    const ContactValues expected = values_;
    for (const int lanes : {8, 16}) {
      if (limit_contact_lanes(lanes) != lanes) continue;
      ++widths;
      const ContactSums wide = evaluate(query);
      for (int i = 0; i < model_.contact.groups() * kGroupPoints; ++i) {
        const auto at = static_cast<std::size_t>(i);
        ASSERT_EQ(values_.distance_mm[at], expected.distance_mm[at]) << lanes << " " << i;
        ASSERT_EQ(values_.density_g_cm3[at], expected.density_g_cm3[at]);
        ASSERT_EQ(values_.gx[at], expected.gx[at]);
      }
      // Sums are added in another order.
      EXPECT_NEAR(wide.engaged_mm2, narrow.engaged_mm2, 1e-4 * (1.0 + narrow.engaged_mm2));
      EXPECT_NEAR(wide.milling, narrow.milling, 1e-4 * (1.0 + narrow.milling));
      EXPECT_NEAR((wide.torque - narrow.torque).norm(), 0.0, 1e-3);
    }
  }
  std::printf("  %d comparisons with registers of 4\n", widths);
}

// Compares the sums with a loop over the points in doubles, and with the known values of a half-immersed ball.
TEST_F(ContactOnBlock, SumsAreThoseOfThePoints) {
  osteon::test::Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    ContactQuery query;
    query.pose_bone_tool = pose_of(random);
    query.density = query.ahead = true;
    query.direction_bone = random.direction();
    query.ahead_mm = 0.1;
    query.most_mm = 0.25;
    query.least_facing = 0.2;
    query.strength = &model_.strength;
    build(query.pose_bone_tool);
    query.groups = model_.contact.active_groups;
    const ContactSums sums = evaluate_contact(patch_, model_.contact, query, values_);
    double area = 0, engaged = 0, density_mm2 = 0, milling = 0;
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    const Vec3 toward = query.pose_bone_tool.rotation.conjugate() * query.direction_bone;
    for (const ContactPoint& p : model_.active) {
      const double facing = p.outward.dot(toward);
      if (facing < query.least_facing) continue;
      area += p.area_mm2 * facing;
      const Vec3 probe = query.pose_bone_tool.point(p.inset_mm) +
                         std::min(query.ahead_mm / facing, query.most_mm) * query.direction_bone;
      double solid = 1.0;
      if (!patch_.solid(probe, solid) || solid >= 0.0) continue;
      const double density = patch_.density_at(probe), share = p.area_mm2 * facing;
      engaged += share;
      density_mm2 += share * density;
      milling += milling_resistance({.diameter_mm = 5.0}, share, p.axis_distance_mm, density);
      force -= share * density * p.outward;
      torque -= share * density * p.inset_mm.cross(p.outward);
    }
    EXPECT_NEAR(sums.area_mm2, area, 1e-3 * area);
    // A point within a ten-thousandth of a millimetre of the surface may or may not count.
    EXPECT_NEAR(sums.engaged_mm2, engaged, 2e-3 * area);
    EXPECT_NEAR(sums.density_mm2, density_mm2, 4e-3 * area);
    EXPECT_NEAR(sums.milling, milling, 3e-3 * (milling + 100.0));
    EXPECT_NEAR((sums.force - force).norm(), 0.0, 4e-3 * area);
    EXPECT_NEAR((sums.torque - torque).norm(), 0.0, 2e-2 * area);
  }
}

// A ball with its middle on the face of the block moves along the face. Half of its disc is in bone. By symmetry it has
// no moment about the line of the feed through its middle.
TEST_F(ContactOnBlock, AHalfImmersedBallHasHalfItsDisc) {
  ContactQuery query;
  query.pose_bone_tool = {{4.5, 3.0, 2.5}, Eigen::Quaterniond::Identity()};
  query.density = query.ahead = true;
  query.direction_bone = Vec3::UnitX();
  query.ahead_mm = 0.1;
  query.most_mm = 0.25;
  build(query.pose_bone_tool);
  query.groups = model_.contact.active_groups;
  const ContactSums sums = evaluate_contact(patch_, model_.contact, query, values_);
  const double disc = std::numbers::pi * 2.5 * 2.5;
  EXPECT_NEAR(sums.area_mm2, disc, 0.03 * disc);
  EXPECT_NEAR(sums.engaged_mm2, 0.5 * disc, 0.05 * disc);
  EXPECT_NEAR(sums.density_mm2 / sums.engaged_mm2, 1.9, 1e-3);
  EXPECT_NEAR(sums.force.y(), 0.0, 0.03 * std::abs(sums.force.x()));
  EXPECT_LT(sums.force.x(), 0.0);
}

// Groups that are far by the clearance are skipped. Nothing that touches may be lost by it.
TEST_F(ContactOnBlock, ClearancePassesOverWhatIsFarOnly) {
  osteon::test::Random random(9);
  int passed = 0;
  for (int trial = 0; trial < 20; ++trial) {
    ContactQuery query;
    query.pose_bone_tool = pose_of(random);
    build(query.pose_bone_tool);
    evaluate(query);
    const ContactValues with = values_;
    Patch without = patch_;
    without.clearance = {};
    query.groups = model_.contact.groups();
    evaluate_contact(without, model_.contact, query, values_);
    for (const int i : points()) {
      const auto at = static_cast<std::size_t>(i);
      if (with.distance_mm[at] < static_cast<float>(query.margin_mm)) {
        EXPECT_EQ(with.distance_mm[at], values_.distance_mm[at]);
      } else {
        passed += with.distance_mm[at] != values_.distance_mm[at];
        // The clearance is a lower bound, and none of the skipped points is within reach of bone.
        const Vec3 p = query.pose_bone_tool.point(point(i).inset_mm);
        EXPECT_GT(field_.solid_mm(p), query.margin_mm - 0.2);
      }
    }
  }
  EXPECT_GT(passed, 500);
  // The result says when neither bone nor clearance is known.
  ContactQuery query;
  query.pose_bone_tool.position_mm = {0, 0, 200};
  evaluate(query);
  EXPECT_FALSE(values_.covered);
}

}  // namespace
}  // namespace osteon::haptic::test
