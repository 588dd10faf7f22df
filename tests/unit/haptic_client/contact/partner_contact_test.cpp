#include "haptic_client/contact/partner_contact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "tests/support/allocation_counter.hpp"

namespace osteon::haptic {
namespace {

constexpr double kTick = 1e-3;
constexpr double kRadius_mm = 2.5;

Tool burr() {
  const Result<Tool> found = find_tool("burr-round-5");
  EXPECT_TRUE(found.has_value());
  return *found;
}

// Burrs whose tips face each other along z. The partner's tip is at this position.
Pose facing(double tip_z_mm, double x_mm = 0.0) {
  return {{x_mm, 0, tip_z_mm}, Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(-1.0), Vec3::UnitX()))};
}

struct Pair {
  Tool tool = burr();
  TouchPoints own{tool};
  SolidLattice solid{tool};
  PartnerContact contact;

  PartnerTool partner(const Pose& pose, double lag_s = 0.0) const { return {7, pose, lag_s, &solid}; }
  // Held there until low pass and slew have settled.
  PartnerForce hold(const Pose& own_pose, const PartnerTool& other, int ticks = 400) {
    PartnerForce force;
    for (int i = 0; i < ticks; ++i) force = contact.step(own, own_pose, std::span(&other, 1), kTick);
    return force;
  }
};

// Two balls that overlap by d are pushed apart with k d along the line of their centres. Samples miss the tip by a
// little.
TEST(PartnerContact, PushesApartByTheOverlap) {
  for (const double overlap_mm : {0.4, 1.0, 1.6}) {
    Pair pair;
    const PartnerForce force = pair.hold({}, pair.partner(facing(-overlap_mm)));
    EXPECT_NEAR(force.depth_mm, overlap_mm, 0.15);
    EXPECT_NEAR(force.force_n.z(), -force.n_per_mm * overlap_mm, 0.15 * force.n_per_mm);
    EXPECT_LT(std::hypot(force.force_n.x(), force.force_n.y()), 0.1 * force.force_n.norm());
    EXPECT_EQ(force.author, 7u);
  }
  // Beside each other, the force is also along the line between the centres. That is not the line between the tips.
  Pair pair;
  const Vec3 between = Vec3(3.5, 0, 2.0 * kRadius_mm - 2.0);
  const PartnerForce force = pair.hold({}, pair.partner(facing(-2.0, 3.5)));
  const double overlap_mm = 2.0 * kRadius_mm - between.norm();
  ASSERT_GT(overlap_mm, 0.3);
  EXPECT_NEAR(force.force_n.norm(), force.n_per_mm * overlap_mm, 0.2 * force.n_per_mm);
  EXPECT_GT(-force.force_n.normalized().dot(between.normalized()), 0.97);
  // The moment about the tip of a force at that point.
  const Vec3 at_mm = Vec3(0, 0, -kRadius_mm) + kRadius_mm * between.normalized();
  EXPECT_LT((force.torque_nmm - at_mm.cross(force.force_n)).norm(), 0.5 * force.force_n.norm());
}

// One user feels the opposite of what the other feels.
TEST(PartnerContact, IsFeltByBothAlike) {
  Pair one, other;
  const Pose there = facing(-0.8, 1.2);
  const PartnerForce here_force = one.hold({}, one.partner(there));
  const PartnerForce there_force = other.hold(there, other.partner({}));
  EXPECT_LT((here_force.force_n + there_force.force_n).norm(), 0.1 * here_force.force_n.norm());
}

TEST(PartnerContact, FeelsNothingThatDoesNotTouch) {
  Pair pair;
  EXPECT_EQ(pair.hold({}, pair.partner(facing(0.1))).force_n, Vec3(Vec3::Zero()));
  EXPECT_EQ(pair.hold({}, pair.partner(facing(80.0))).force_n, Vec3(Vec3::Zero()));
  EXPECT_GT(pair.hold({}, pair.partner(facing(-1.0))).force_n.norm(), 0.5);
  // A partner whose pose is too old, or who has no solid, causes no force at once.
  EXPECT_EQ(pair.hold({}, pair.partner(facing(-1.0), 0.6), 1).force_n, Vec3(Vec3::Zero()));
  PartnerTool unknown = pair.partner(facing(-1.0));
  unknown.solid = nullptr;
  EXPECT_EQ(pair.hold({}, unknown, 1).force_n, Vec3(Vec3::Zero()));
}

TEST(PartnerContact, IsBoundedAndGrowsSlowly) {
  PartnerParams params;
  params.most_n = 2.0;
  Pair pair;
  pair.contact = PartnerContact(params);
  double before_n = 0.0, most_n = 0.0;
  for (int i = 0; i < 2000; ++i) {
    // A partner that jumps in and out, and a hand that does so too.
    const PartnerTool partner = pair.partner(facing((i / 130) % 2 ? -4.0 : 5.0));
    const Pose own{{0, 0, (i / 70) % 2 ? 1.5 : 0.0}, Eigen::Quaterniond::Identity()};
    const double now_n = pair.contact.step(pair.own, own, std::span(&partner, 1), kTick).force_n.norm();
    EXPECT_LE(now_n, params.most_n + 1e-9);
    EXPECT_LE(now_n - before_n, params.most_n_per_s * kTick + 1e-9);
    before_n = now_n;
    most_n = std::max(most_n, now_n);
  }
  EXPECT_GT(most_n, 1.9);
}

TEST(PartnerContact, IsSofterWhereTheLineIsLonger) {
  const PartnerParams params;
  double before = 1e9;
  for (const double lag_s : {0.0, 0.02, 0.05, 0.15, 0.4}) {
    Pair pair;
    const PartnerForce force = pair.hold({}, pair.partner(facing(-1.0), lag_s));
    EXPECT_LE(force.n_per_mm * (lag_s + params.low_pass_s), params.damping_n_s_per_mm);
    EXPECT_GT(force.n_per_mm, 0.0);
    EXPECT_LT(force.n_per_mm, before);
    before = force.n_per_mm;
  }
  // While the tools touch, the stiffness does not rise.
  Pair pair;
  const double soft = pair.hold({}, pair.partner(facing(-1.0), 0.15)).n_per_mm;
  EXPECT_LE(pair.hold({}, pair.partner(facing(-1.0), 0.0)).n_per_mm, soft);
}

// Into a partner that stands still and out again, at any speed and sideways. The hand gets no more than it put in.
TEST(PartnerContact, GivesBackLessThanWasPutIn) {
  for (const double hertz : {0.5, 3.0, 12.0}) {
    Pair pair;
    const PartnerTool partner = pair.partner(facing(0.0, 1.0));
    for (int i = 0; i < 6000; ++i) {
      const double phase = 6.283185307 * hertz * i * kTick;
      const Pose own{{0.6 * std::sin(0.37 * phase), 0.5 * std::cos(0.61 * phase), 0.9 - 1.3 * std::cos(phase)},
                     Eigen::Quaterniond::Identity()};
      static_cast<void>(pair.contact.step(pair.own, own, std::span(&partner, 1), kTick));
    }
    EXPECT_GT(pair.contact.put_in_mj(), 1.0);
    EXPECT_LT(pair.contact.released_mj(), pair.contact.put_in_mj()) << hertz;
  }
}

// Two hands without damping of their own press their tools against each other over a connection.
struct Meeting {
  double most_late_mm_per_s = 0, force_n[2] = {}, n_per_mm = 0;
};
Meeting meet(double delay_s, double told_lag_s) {
  constexpr double kMass = 2.5e-3, kHand = 0.2, kPush_mm = 1.0;  // N·s²/mm, N/mm, each beyond the middle
  Pair pairs[2];
  std::deque<double> sent[2];
  double z_mm[2] = {-0.3, -0.3}, speed[2] = {},
         known_mm[2] = {-0.3, -0.3};  // of each tip towards the other, from the middle
  Meeting result;
  for (int i = 0; i < 20'000; ++i) {
    for (int user = 0; user < 2; ++user) {
      sent[user].push_back(z_mm[user]);
      const auto late = static_cast<std::size_t>(delay_s / kTick);
      // States arrive 60 times a second, and nothing in between.
      if (i % 16 == 0 && sent[user].size() > late) known_mm[1 - user] = sent[user][sent[user].size() - 1 - late];
    }
    for (int user = 0; user < 2; ++user) {
      const PartnerTool partner = pairs[user].partner(facing(-known_mm[user]), told_lag_s);
      const Pose own{{0, 0, z_mm[user]}, Eigen::Quaterniond::Identity()};
      const PartnerForce force = pairs[user].contact.step(pairs[user].own, own, std::span(&partner, 1), kTick);
      result.force_n[user] = -force.force_n.z();
      result.n_per_mm = force.n_per_mm;
      speed[user] += kTick / kMass * (kHand * (kPush_mm - z_mm[user]) + force.force_n.z());
      z_mm[user] += kTick * speed[user];
      if (i >= 18'000) result.most_late_mm_per_s = std::max(result.most_late_mm_per_s, std::abs(speed[user]));
    }
  }
  return result;
}

TEST(PartnerContact, ComesToRestOverALongLine) {
  for (const double delay_s : {0.0, 0.05, 0.15}) {
    const Meeting met = meet(delay_s, delay_s + 0.016);
    EXPECT_LT(met.most_late_mm_per_s, 1.0) << delay_s;
    // Springs in series: two hands and the tools between them, over both pushes.
    const double rest_n = 2.0 / (1.0 / met.n_per_mm + 2.0 / 0.2);
    for (const double force_n : met.force_n) EXPECT_NEAR(force_n, rest_n, 0.1 * rest_n) << delay_s;
  }
}

// Shows that the lag must be known: if it is as stiff as on a short connection, the same hands go on shaking each
// other.
TEST(PartnerContact, WouldShakeIfTheLagWereNotCounted) { EXPECT_GT(meet(0.15, 0.0).most_late_mm_per_s, 20.0); }

TEST(PartnerContact, DoesNotAllocate) {
  Pair pair;
  std::vector<PartnerTool> partners;
  for (std::uint64_t author = 1; author <= 20; ++author) {
    partners.push_back(pair.partner(facing(-1.0, 0.1 * static_cast<double>(author))));
    partners.back().author = author;
  }
  const test::AllocationCounter heap;
  for (int i = 0; i < 200; ++i) {
    const std::span<const PartnerTool> there(partners.data(), static_cast<std::size_t>(i % 21));
    static_cast<void>(pair.contact.step(pair.own, {}, there, kTick));
  }
  pair.contact.reset();
  EXPECT_EQ(heap.count(), 0);
}

// Every tool has points at which it can be touched, few enough for a tick.
TEST(TouchPoints, AreOnTheToolAndNotTooMany) {
  for (const Tool& tool : builtin_tools()) {
    const TouchPoints touch(tool, 400);
    EXPECT_GE(touch.points_mm().size(), 20u) << tool.name;
    EXPECT_LE(touch.points_mm().size(), 400u) << tool.name;
    for (const Vec3& p : touch.points_mm()) {
      ASSERT_LT(std::abs(signed_distance_mm(tool, p)), 0.05) << tool.name;
      ASSERT_LE((p - touch.centre_mm()).norm(), touch.radius_mm() + 1e-9);
    }
  }
}

}  // namespace
}  // namespace osteon::haptic
