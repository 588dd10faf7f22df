#include "common/mechanics/compliant_mount.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "tests/support/allocation_counter.hpp"
#include "tests/support/mount/two_users.hpp"

namespace osteon {
namespace {

using test::TwoUsersRun;

constexpr double kTick = 1e-3;
constexpr double kServerTick = 1.0 / 120.0;

TwoUsersRun over_line(double one_ms, double other_ms, long ticks = 120'000) {
  TwoUsersRun run;
  run.ticks = ticks;
  run.delay_ms[0] = one_ms;
  run.delay_ms[1] = other_ms;
  run.jitter_ms = one_ms + other_ms > 0.0 ? 30.0 : 0.0;
  run.loss = one_ms + other_ms > 0.0 ? 0.3 : 0.0;
  return run;
}
double allowed_mj(const TwoUsersRun& run) { return 2.0 * run.client.allowance_mj + 1e-6; }

// Share of the other's force. The remaining few tenths of a percent come from arms that turn with the bone.
TEST(MountServer, LetsEachUserFeelTheOtherAsTheClosedFormSays) {
  for (const auto& [one_ms, other_ms] : {std::pair{0.0, 0.0}, {50.0, 50.0}, {150.0, 150.0}, {0.0, 150.0}}) {
    const auto result = test::push_each_other(over_line(one_ms, other_ms));
    EXPECT_GE(result.rests, 3);
    EXPECT_GT(result.least_other_n, 0.5);
    EXPECT_LT(result.worst_error, 0.05) << one_ms << ' ' << other_ms;
  }
}

TEST(MountServer, GivesNoMoreThanWasPutInAndItsAllowance) {
  for (const double stiffness : {1.0, 3.0})
    for (const auto& [one_ms, other_ms] : {std::pair{0.0, 0.0}, {50.0, 50.0}, {150.0, 150.0}, {0.0, 150.0}})
      for (const bool shaken : {false, true}) {
        TwoUsersRun run = over_line(one_ms, other_ms, 60'000);
        run.hand_stiffness = stiffness;
        run.shaken = shaken;
        const auto result = test::push_each_other(run);
        EXPECT_LE(result.most_created_mj, allowed_mj(run)) << stiffness << ' ' << one_ms << ' ' << other_ms;
        EXPECT_LT(result.account_difference_mj, 1e-6);
        EXPECT_LE(result.most_step_mm, run.client.most_mm_per_s * kTick + 1e-12);
      }
}

// Shows that these hands are hard to serve: with an account that is always full, the same connections give them joules.
TEST(MountServer, WouldMakeEnergyWithoutTheController) {
  TwoUsersRun run = over_line(50.0, 50.0, 60'000);
  run.hand_stiffness = 3.0;
  run.shaken = true;
  run.client.allowance_mj = run.client.reserve_mj = 1e9;
  const auto result = test::push_each_other(run);
  EXPECT_EQ(result.held_back, 0);
  EXPECT_GT(result.most_created_mj, 1000.0);
}

// Random loads that no hand would make, and bones that jump.
TEST(MountFollower, PaysForWhatItGivesWhateverIsSent) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto any = [&] { return Vec3(even(random), even(random), even(random)); };
  MountFollowerParams params;
  MountFollower bone(params);
  MountPose seen;
  double given_mj = 0.0, worst_mj = 0.0;
  int held_back = 0;
  for (int i = 0; i < 50'000; ++i) {
    if (i % 8 == 0) {
      ++seen.seen_seq;
      seen.shift = {10.0 * any(), 0.2 * any()};
      seen.push_seq = seen.seen_seq - 1;
      bone.see(seen);
    }
    const Load load{30.0 * any(), 2000.0 * any()};
    const Pose before = bone.pose_world_bone();
    bone.step(load, kTick);
    const Pose after = bone.pose_world_bone();
    const Eigen::AngleAxisd turned(after.rotation * before.rotation.conjugate());
    given_mj -=
        load.force_n.dot(after.position_mm - before.position_mm) + load.moment_nmm.dot(turned.angle() * turned.axis());
    worst_mj = std::max(worst_mj, given_mj);
    held_back += bone.held_back();
  }
  EXPECT_LE(worst_mj, params.allowance_mj + 1e-3);
  EXPECT_NEAR(bone.released_mj() - bone.put_in_mj(), given_mj, 1e-3);
  EXPECT_GT(held_back, 1000);
}

// Once the hand lets go, or is paid for, the bone goes exactly to the pose that the server sends.
TEST(MountFollower, ForgetsNothingThatItHeldBack) {
  MountFollowerParams params;
  MountFollower bone(params);
  MountPose seen;
  const Load load{{20.0, 0, 0}, Vec3::Zero()};
  const auto run = [&](const Load& held, double energy_mj, int ticks = 4000) {
    for (int i = 0; i < ticks; ++i) {
      if (i % 8 == 0) {
        ++seen.seen_seq;
        seen.shift.place_mm = {-3.0, 1.0, 0.0};
        seen.energy_mj = energy_mj;
        bone.see(seen);
      }
      bone.step(held, kTick);
    }
  };
  // Against the load it goes as far as the allowance pays for. Sideways it goes all the way.
  run(load, 0.0);
  EXPECT_NEAR(bone.shift().place_mm.x(), -params.allowance_mj / 20.0, 1e-9);
  EXPECT_NEAR(bone.shift().place_mm.y(), 1.0, 1e-6);
  EXPECT_TRUE(bone.held_back());
  EXPECT_NEAR(bone.released_mj(), params.allowance_mj, 1e-9);
  run(load, 20.0);
  EXPECT_NEAR(bone.shift().place_mm.x(), -(params.allowance_mj + 20.0) / 20.0, 1e-9);
  run({}, 20.0);
  EXPECT_NEAR(bone.shift().place_mm.x(), -3.0, 1e-6);
  EXPECT_FALSE(bone.held_back());
}

// The ledger of a hand looks one tick ahead and counts on no more. Tests the moment when its budget is used up, and a
// hand that lets go at once after it held the bone.
TEST(MountFollower, SetsOutAndStopsNoFasterThanABoneDoes) {
  const MountFollowerParams params;
  const Load loads[] = {{{20.0, 0, 0}, Vec3::Zero()}, {Vec3::Zero(), {0, 800.0, 0}}, {{20.0, 0, 0}, {0, 800.0, 0}}};
  for (const Load& load : loads) {
    MountFollower bone(params);
    Shift before, last;
    double most_mm = 0.0, most_rad = 0.0;
    for (int i = 0; i < 3000; ++i) {
      if (i % 8 == 0) bone.see({static_cast<std::uint64_t>(i + 1), {{-8.0, 0, 0}, {0, -0.2, 0}}, 0.0, 0, 0.0});
      bone.step(i < 1500 ? load : Load{}, kTick);
      const Shift now = bone.shift();
      most_mm = std::max(most_mm, (now.place_mm - 2.0 * last.place_mm + before.place_mm).norm());
      most_rad = std::max(most_rad, (now.turn_rad - 2.0 * last.turn_rad + before.turn_rad).norm());
      before = std::exchange(last, now);
      if (i == 1499) {
        EXPECT_NEAR(bone.released_mj(), params.allowance_mj, 1e-3);
        EXPECT_TRUE(bone.held_back());
      }
    }
    EXPECT_LE(most_mm, 1.0001 * params.most_mm_per_s2 * kTick * kTick);
    EXPECT_LE(most_rad, 1.0001 * params.most_rad_per_s2 * kTick * kTick);
    EXPECT_NEAR(last.place_mm.x(), -8.0, 1e-6);
    EXPECT_NEAR(last.turn_rad.y(), -0.2, 1e-6);
  }
}

TEST(MountFollower, FollowsTheNewestAndStandsInSilence) {
  MountFollower bone{MountFollowerParams{}};
  const auto told = [](std::uint64_t seq, double x_mm) {
    MountPose seen;
    seen.seen_seq = seq;
    seen.shift.place_mm.x() = x_mm;
    return seen;
  };
  bone.see(told(5, 2.0));
  bone.see(told(4, -9.0));
  MountPose bad = told(6, 0.0);
  bad.shift.place_mm.y() = std::nan("");
  bone.see(bad);
  double before = 0.0;
  for (int i = 0; i < 400; ++i) {
    bone.step({}, kTick);
    EXPECT_GE(bone.shift().place_mm.x(), before);
    before = bone.shift().place_mm.x();
  }
  EXPECT_GT(before, 0.5);
  EXPECT_LE(before, 2.0);
  for (int i = 0; i < 200; ++i) bone.step({}, kTick);
  const double stands = bone.shift().place_mm.x();
  for (int i = 0; i < 200; ++i) bone.step({}, kTick);
  EXPECT_EQ(bone.shift().place_mm.x(), stands);
  // A new session counts from one again.
  bone.rejoin();
  bone.see(told(1, 2.0));
  for (int i = 0; i < 200; ++i) bone.step({}, kTick);
  EXPECT_GT(bone.shift().place_mm.x(), stands);
}

TEST(MountFollower, CountsGrantsOfTheNewSessionOnly) {
  MountFollower bone{MountFollowerParams{}};
  MountPose seen;
  seen.seen_seq = 1;
  seen.energy_mj = 30.0;
  bone.see(seen);
  EXPECT_EQ(bone.granted_mj(), 0.0);
  seen.seen_seq = 3;
  seen.energy_mj = 40.0;
  bone.see(seen);
  seen.seen_seq = 2;  // overtaken
  seen.energy_mj = 90.0;
  bone.see(seen);
  EXPECT_EQ(bone.granted_mj(), 10.0);
  bone.rejoin();
  seen.seen_seq = 1;
  seen.energy_mj = 200.0;
  bone.see(seen);
  EXPECT_EQ(bone.granted_mj(), 10.0);
}

// A grant that nobody here needs goes to the others, all of it and only once.
TEST(MountFollower, HandsOnWhatItDoesNotNeed) {
  MountFollowerParams params;
  MountFollower bone(params);
  MountPose seen;
  for (int i = 0; i < 10'000; ++i) {
    if (i % 8 == 0 && i < 9'000) {
      ++seen.seen_seq;
      seen.energy_mj = i > 0 ? 20.0 : 0.0;
      bone.see(seen);
    }
    bone.step({}, kTick);
    ASSERT_NEAR(bone.funds_mj() + bone.given_mj(), params.allowance_mj + bone.granted_mj(), 1e-9);
  }
  EXPECT_EQ(bone.granted_mj(), 20.0);
  EXPECT_NEAR(bone.given_mj(), 20.0, 1e-3);
  EXPECT_GE(bone.push().energy_mj, 19.99);
}

TEST(MountFollower, DoesNotAllocate) {
  MountFollower bone{MountFollowerParams{}};
  MountPose seen;
  const test::AllocationCounter heap;
  for (int i = 0; i < 1000; ++i) {
    ++seen.seen_seq;
    seen.shift = {{0.001 * i, 0, 0}, {0, 1e-4 * i, 0}};
    bone.see(seen);
    bone.step({{5, 1, 0}, {0, 300, 0}}, kTick);
    static_cast<void>(bone.push());
    static_cast<void>(bone.pose_world_bone());
  }
  EXPECT_EQ(heap.count(), 0);
}

MountLoad pushed(std::uint64_t seq, const Vec3& force_n, double energy_mj = 0.0) {
  MountLoad push;
  push.push_seq = seq;
  push.load.force_n = force_n;
  push.energy_mj = energy_mj;
  return push;
}

TEST(MountServer, AddsThePushesOfAll) {
  MountServer bone{MountServerParams{}};
  bone.join(1);
  bone.join(2);
  EXPECT_TRUE(bone.receive(1, pushed(1, {10, 0, 0})));
  EXPECT_TRUE(bone.receive(2, pushed(1, {-4, 0, 0})));
  EXPECT_FALSE(bone.receive(2, pushed(1, {90, 0, 0})));  // again
  EXPECT_FALSE(bone.receive(3, pushed(1, {90, 0, 0})));  // nobody
  EXPECT_FALSE(bone.receive(1, pushed(2, {std::nan(""), 0, 0})));
  for (std::uint64_t i = 2; i < 240; ++i) {
    EXPECT_TRUE(bone.receive(1, pushed(i, {10, 0, 0})));
    EXPECT_TRUE(bone.receive(2, pushed(i, {-4, 0, 0})));
    bone.step(kServerTick);
  }
  EXPECT_NEAR(bone.seen(1).shift.place_mm.x(), 6.0 / 5.0, 1e-6);
  EXPECT_EQ(bone.seen(1).push_seq, 239u);
  EXPECT_EQ(bone.seen(7).seen_seq, 0u);
  // A user who leaves or falls silent does not push any more.
  bone.leave(1);
  for (int i = 0; i < 600; ++i) bone.step(kServerTick);
  EXPECT_LT(bone.seen(2).shift.place_mm.norm(), 1e-3);
}

// Grants are shares of what was given. Nothing is granted twice, or from before a session.
TEST(MountServer, GrantsWhatOthersGaveAndNoMore) {
  MountServer bone{MountServerParams{}};
  for (const std::uint64_t author : {1, 2, 3}) bone.join(author);
  EXPECT_TRUE(bone.receive(1, pushed(1, Vec3::Zero(), 500.0)));
  EXPECT_EQ(bone.seen(2).energy_mj, 0.0);
  EXPECT_TRUE(bone.receive(1, pushed(2, Vec3::Zero(), 510.0)));
  EXPECT_TRUE(bone.receive(1, pushed(4, Vec3::Zero(), 514.0)));
  EXPECT_FALSE(bone.receive(1, pushed(3, Vec3::Zero(), 512.0)));
  EXPECT_TRUE(bone.receive(1, pushed(5, Vec3::Zero(), 505.0)));
  EXPECT_EQ(bone.seen(1).energy_mj, 0.0);
  EXPECT_DOUBLE_EQ(bone.seen(2).energy_mj, 7.0);
  EXPECT_DOUBLE_EQ(bone.seen(3).energy_mj, 7.0);
  bone.join(1);
  EXPECT_TRUE(bone.receive(1, pushed(1, Vec3::Zero(), 900.0)));
  EXPECT_DOUBLE_EQ(bone.seen(2).energy_mj, 7.0);
  // Work beyond what an arm can do does not count as put in.
  EXPECT_TRUE(bone.receive(1, pushed(2, Vec3::Zero(), 1e12)));
  EXPECT_LT(bone.seen(2).energy_mj, 1e5);
}

TEST(MountServer, TellsTheSlowestLag) {
  MountServer bone{MountServerParams{}};
  bone.join(1);
  bone.join(2);
  for (std::uint64_t i = 1; i < 300; ++i) {
    bone.step(kServerTick);
    static_cast<void>(bone.seen(1));
    static_cast<void>(bone.seen(2));
    MountLoad near = pushed(i, Vec3::Zero()), far = near;
    near.seen_seq = i > 2 ? i - 2 : 0;
    far.seen_seq = i > 36 ? i - 36 : 0;
    EXPECT_TRUE(bone.receive(1, near));
    EXPECT_TRUE(bone.receive(2, far));
  }
  EXPECT_NEAR(bone.seen(1).lag_s, 36 * kServerTick, 1e-6);
}

// The program haptic_mount in tests/perf runs this for a million ticks.
TEST(MountServer, StaysStableOverALongLine) {
  TwoUsersRun run = over_line(150.0, 150.0, 200'000);
  run.seed = 3;
  const auto result = test::push_each_other(run);
  EXPECT_LE(result.most_created_mj, allowed_mj(run));
  EXPECT_LT(result.most_force_n[1], 1.5 * result.most_force_n[0]);
  EXPECT_LT(result.worst_error, 0.05);
}

}  // namespace
}  // namespace osteon
