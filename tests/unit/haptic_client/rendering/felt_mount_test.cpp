// Two haptic loops at one bone on a compliant mount, with a simulated hand at each, connections between them, and the
// server's end. Each hand feels through the bone what the other does.
#include "haptic_client/rendering/felt_mount.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "common/volume/replica.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/device/simulated_device.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::haptic {
namespace {

constexpr double kTick = 1e-3;
constexpr double kThickness_mm = 12.0;

// The block has one thickness along z, so two hands that press from both sides do it along a line through its middle.
const Case& block() {
  static const Case bone = test::plain_block(24.0, kThickness_mm, 0.5);
  return bone;
}
const Vec3 kMiddle_mm(0, 0, -0.5 * kThickness_mm);

// One connection. Packets take `delay_ms`, with up to `jitter_ms` more or less, and are lost at the given rate.
struct LineQuality {
  double delay_ms = 0, jitter_ms = 0, loss = 0;
};
template <class Message>
class Line {
 public:
  Line(const LineQuality& quality, unsigned seed) : quality_(quality), random_(seed) {}
  void send(const Message& message, int now_ms) {
    const double lost = even_(random_), shift = 2.0 * even_(random_) - 1.0;
    if (lost < quality_.loss) return;
    const double after = std::max(0.0, quality_.delay_ms + shift * quality_.jitter_ms);
    under_way_.push_back({now_ms + static_cast<int>(after), message});
  }
  template <class Take>
  void deliver(int now_ms, const Take& take) {
    std::erase_if(under_way_, [&](const auto& packet) {
      if (packet.first > now_ms) return false;
      take(packet.second);
      return true;
    });
  }

 private:
  LineQuality quality_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> even_{0.0, 1.0};
  std::vector<std::pair<int, Message>> under_way_;
};

// A hand of 5.5 N/mm at a device at a loop. It holds a burr that does not turn, over the bone or under it.
struct User {
  User(const LineQuality& line, bool from_above, unsigned seed)
      : rotation(Eigen::AngleAxisd(from_above ? std::acos(-1.0) : 0.0, Vec3::UnitX())),
        into(0, 0, from_above ? -1.0 : 1.0),
        face_mm(from_above ? Vec3(0, 0, 0) : Vec3(0, 0, -kThickness_mm)),
        replica(block(), BodyId{}),
        mounted(mount_about(kMiddle_mm)),
        up(line, seed),
        down(line, seed + 1) {
    LoopParams params = loop_params(device.limits(), 1.0);
    params.ramp_s = 1e-9;
    std::vector<ToolModel> tools{ToolModel(*find_tool("burr-round-5"), block().pitch_mm())};
    loop = std::make_unique<HapticLoop>(params, std::move(tools));
    const Pose start{face_mm - kAway_mm * into, rotation};
    WorkspaceMapping mapping;
    mapping.align(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), 1.0, Vec3::Zero(),
                  start.position_mm);
    loop->take_up(0, start, mapping);
    device.take(expert_hand(), mapping.pose_device_tool(start).position_mm);
    build(start);
  }
  void build(const Pose& at) {
    builder.build(replica.bodies(), loop->tool(0), at, patch);
    built_at_mm = at.position_mm;
  }

  // `push_mm`: how far into the resting bone the hand's target is.
  void tick() {
    HandCommand command;
    command.target_mm = loop->mapping().pose_device_tool({face_mm + push_mm * into, rotation}).position_mm;
    command.axis = loop->mapping().to_device(into);
    device.command(command, loop->mapping().pose_device_tool({Vec3::Zero(), rotation}).rotation, 0u);
    device.step(kTick);
    LoopInput input;
    input.pose_device_tool = device.read().pose_device_tool;
    const Pose before = mounted.pose_rest_bone();
    {
      const test::AllocationCounter heap;
      mounted.step(*loop, last);
      last = loop->tick(input, patch);
      allocations += heap.count();
    }
    device.write({last.device.force_n, last.device.torque_nmm});
    // Growth of the force beyond what the handle's own way explains: spring and damping of the coupling.
    const Vec3 handle_mm = input.pose_device_tool.position_mm;
    const double by_hand_n =
        loop->coupling_n_per_mm() * (2.0 * (handle_mm - handle_before_mm).norm() + moved_before_mm);
    if (ticks > 1) step_n = std::max(step_n, last.device.force_n.norm() - force_n() - by_hand_n);
    moved_before_mm = (handle_mm - handle_before_mm).norm();
    handle_before_mm = handle_mm;
    shown_n = last.device.force_n.norm();
    // Work of the hand on the displayed bone, computed from outside: force times way of the contact point.
    const Vec3 tip_mm = last.pose_bone_proxy.position_mm;
    put_in_mj += mounted.load().force_n.dot(mounted.pose_rest_bone().point(tip_mm) - before.point(tip_mm));
    least_mj = std::min(least_mj, put_in_mj);
    if (++ticks % 12 == 0 && (last.pose_bone_proxy.position_mm - built_at_mm).norm() > 0.05)
      build(last.pose_bone_proxy);
  }
  double force_n() const { return shown_n; }
  double shown_along_n() const { return -loop->mapping().to_bone(last.coupling.device_n).dot(into); }
  // Force on the bone, along the hand's push.
  double pressed_n() const { return mounted.load().force_n.dot(into); }

  static constexpr double kAway_mm = 2.0;
  Eigen::Quaterniond rotation;
  Vec3 into, face_mm;
  Replica replica;
  PatchBuilder builder;
  Patch patch;
  Vec3 built_at_mm;
  SimulatedDevice device;
  std::unique_ptr<HapticLoop> loop;
  FeltMount mounted;
  Line<MountLoad> up;
  Line<MountPose> down;
  LoopReport last;
  double push_mm = -kAway_mm, step_n = 0, put_in_mj = 0, least_mj = 0, shown_n = 0, moved_before_mm = 0;
  Vec3 handle_before_mm = Vec3::Zero();
  long ticks = 0;
  std::int64_t allocations = 0;
};

struct Room {
  Room(const LineQuality& one, const LineQuality& other, bool mount = true)
      : stands(mount), server({.mount = mount_about(kMiddle_mm)}) {
    users[0] = std::make_unique<User>(one, true, 11);
    users[1] = std::make_unique<User>(other, false, 23);
    server.join(1);
    server.join(2);
  }
  void run(int ms) {
    for (int i = 0; i < ms; ++i, ++now_ms) {
      for (std::uint64_t u = 0; u < 2; ++u) {
        User& user = *users[u];
        user.down.deliver(now_ms, [&](const MountPose& seen) { user.mounted.see(1, seen); });
        user.tick();
        if (const auto push = user.mounted.push()) user.up.send(*push, now_ms);
        user.up.deliver(now_ms, [&](const MountLoad& push) { (void)server.receive(u + 1, push); });
      }
      if (!stands || now_ms % 8 != 0) continue;
      server.step(8e-3);
      for (std::uint64_t u = 0; u < 2; ++u) users[u]->down.send(server.seen(u + 1), now_ms);
    }
  }
  void push(double one_mm, double other_mm) {
    users[0]->push_mm = one_mm;
    users[1]->push_mm = other_mm;
  }

  bool stands;
  MountServer server;
  std::unique_ptr<User> users[2];
  int now_ms = 0;
};

// Springs of hand and coupling in series.
double felt_n_per_mm(const User& user) {
  return 1.0 / (1.0 / expert_hand().stiffness_n_per_mm + 1.0 / user.loop->coupling_n_per_mm());
}

// At rest f = f0 - k x, with f0 on bone that stands and x the mount's way along the push: K x = f1 - f2.
TEST(FeltMount, LetsOneHandFeelTheOtherThroughTheBone) {
  Room fixed({}, {}, false);
  fixed.push(1.2, 2.4);
  fixed.run(4000);
  // Without a mount no load is sent, nothing moves and nobody feels the other.
  EXPECT_FALSE(fixed.users[0]->mounted.there());
  EXPECT_EQ(fixed.users[0]->mounted.most_mm(), 0.0);
  const double f0[2] = {fixed.users[0]->shown_along_n(), fixed.users[1]->shown_along_n()};
  ASSERT_GT(f0[0], 3.0);
  ASSERT_GT(f0[1], f0[0] + 3.0);

  const LineQuality lines[][2] = {
      {{}, {}}, {{50, 30, 0.3}, {50, 30, 0.3}}, {{150, 30, 0.3}, {150, 30, 0.3}}, {{}, {150, 30, 0.3}}};
  for (const auto& line : lines) {
    Room room(line[0], line[1]);
    const double k = felt_n_per_mm(*room.users[0]), mount = mount_about(kMiddle_mm).stiffness_n_per_mm;
    // One alone, then both.
    room.push(1.2, -User::kAway_mm);
    room.run(12'000);
    const double alone_n = room.users[0]->pressed_n(), alone_expected_n = f0[0] * mount / (mount + k);
    EXPECT_NEAR(alone_n, alone_expected_n, 0.05 * alone_expected_n) << line[1].delay_ms;
    room.push(1.2, 2.4);
    room.run(16'000);
    const double x_mm = (f0[0] - f0[1]) / (mount + 2.0 * k);  // along the first one's push
    const double expected_n[2] = {f0[0] - k * x_mm, f0[1] + k * x_mm};
    const double other_makes_n = expected_n[0] - alone_expected_n;
    std::printf(
        "  %.0f and %.0f ms: alone %.2f N (%.2f), together %.2f and %.2f N (%.2f and %.2f); most %.2f mm, step %.2f N, "
        "given back %.2f and %.2f mJ\n",
        line[0].delay_ms, line[1].delay_ms, alone_n, alone_expected_n, room.users[0]->pressed_n(),
        room.users[1]->pressed_n(), expected_n[0], expected_n[1], room.users[0]->mounted.most_mm(),
        std::max(room.users[0]->step_n, room.users[1]->step_n), -room.users[0]->least_mj, -room.users[1]->least_mj);
    ASSERT_GT(other_makes_n, 2.0);
    EXPECT_NEAR(room.users[0]->pressed_n() - alone_n, other_makes_n, 0.05 * other_makes_n);
    EXPECT_NEAR(room.users[1]->pressed_n(), expected_n[1], 0.05 * expected_n[1]);
    double created_mj = 0.0;
    for (const auto& user : room.users) {
      // What neither the hand nor the loop's slew limit explains.
      EXPECT_LE(user->step_n, user->loop->params().slew_n_per_ms);
      EXPECT_EQ(user->allocations, 0);
      created_mj -= user->put_in_mj;
      const MountFollower& shown = user->mounted.shown();
      EXPECT_NEAR(shown.put_in_mj() - shown.released_mj(), user->put_in_mj, 0.05 + 0.02 * shown.put_in_mj());
      EXPECT_GE(shown.funds_mj(), -1e-9);
    }
    EXPECT_LE(created_mj, 2.0 * MountFollowerParams{}.allowance_mj);
  }
}

// The bone follows its mount under a hand that holds still. The tool stays on it, and forces turn with it.
TEST(FeltMount, TurnsForcesWithTheBone) {
  for (const double angle : {0.0, 0.3}) {
    User user({}, true, 1);
    const Pose bone{Vec3(0.0, 0.0, 0.5), Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vec3::UnitX()))};
    user.loop->see_bone(bone);
    user.push_mm = 1.0;
    for (int i = 0; i < 3000; ++i) {
      user.loop->see_bone(bone);
      user.tick();
      if (i % 12 == 0) user.build(user.last.pose_bone_proxy);
    }
    ASSERT_GT(user.force_n(), 2.0);
    // The face's normal in the bone's present pose.
    const Vec3 shown = user.loop->mapping().to_bone(user.last.coupling.device_n).normalized();
    const Vec3 normal = bone.direction(Vec3::UnitZ());
    EXPECT_GT(shown.dot(normal), angle == 0.0 ? 0.999 : 0.9);
    EXPECT_GT(shown.dot(normal), shown.dot(Vec3::UnitZ()) - 1e-9);
    // The tip lies on the bone's face, in the bone's frame and not the room's.
    EXPECT_NEAR(user.last.pose_bone_proxy.position_mm.z(), 0.0, angle == 0.0 ? 0.15 : 0.6);
  }
}

// A hand may be deeper in bone than its device can show. This slack lies between hand and tool and stays with them: a
// bone that turns under the tool's tip does not swing the slack about. The loop counts the work on hand and bone as an
// outside observer does.
TEST(FeltMount, TurnsUnderSlackWithoutIt) {
  User user({}, true, 1);
  user.push_mm = 25.0;
  double given_mj = 0.0;
  Pose bone;
  const auto run = [&](double angle, int ticks) {
    const Pose before = bone;
    bone.rotation = Eigen::AngleAxisd(angle, Vec3::UnitX());
    for (int i = 0; i < ticks; ++i) {
      // Work on the bone as it turns, under what pressed on it until then. Work on the hand as it moves.
      const Vec3 held_n = user.last.coupling.device_n, tip_mm = user.last.pose_bone_proxy.position_mm;
      if (i == 0) given_mj -= user.loop->mapping().to_bone(held_n).dot(bone.point(tip_mm) - before.point(tip_mm));
      const Vec3 handle_mm = user.handle_before_mm;
      user.loop->see_bone(bone);
      user.tick();
      given_mj += held_n.dot(user.handle_before_mm - handle_mm);
    }
    return bone.point(user.last.pose_bone_proxy.position_mm);
  };
  const Vec3 tip_mm = run(0.0, 3000);
  ASSERT_GT(user.last.coupling.offset_mm.norm(), 10.0);
  const double before_n = user.force_n(), before_mj = user.last.coupling.energy.episode_mj;
  given_mj = 0.0;
  for (int i = 1; i <= 100; ++i) {
    const double angle = 1e-3 * i;
    const Vec3 moved_mm = run(angle, 20) - tip_mm;
    // It slides a little on a tilting face, and the hand yields. Otherwise the slack would carry it by its whole
    // length.
    if (angle > 0.01) {
      ASSERT_LE(moved_mm.norm(), 0.5 * angle * user.last.coupling.offset_mm.norm()) << angle;
    }
  }
  EXPECT_GT(user.force_n(), 0.9 * before_n);
  EXPECT_GT(std::abs(given_mj), 1.0);
  std::printf("  given %.4f mJ outside, %.4f mJ by the ledger\n", given_mj,
              user.last.coupling.energy.episode_mj - before_mj);
  EXPECT_NEAR(user.last.coupling.energy.episode_mj - before_mj, given_mj, 0.02 * std::abs(given_mj));
}

// A bone comes at the hand as fast as a bone is ever shown, 60 mm/s. A force that would rise by 3 N every millisecond
// comes slowly.
TEST(FeltMount, WhatMovesTheBoneRaisesTheForceSlowly) {
  User user({}, true, 1);
  user.push_mm = 0.5;
  Pose bone;
  double before_n = 0.0, most_n = 0.0;
  for (int i = 0; i < 2000; ++i) {
    if (i >= 1900 && i < 1920) bone.position_mm.z() += 0.06;
    user.loop->see_bone(bone);
    user.tick();
    if (i == 1899) before_n = user.force_n(), user.step_n = 0.0;
    most_n = std::max(most_n, user.force_n());
  }
  ASSERT_GT(before_n, 1.0);
  EXPECT_GT(most_n, before_n + 3.0) << "it is felt";
  EXPECT_LE(user.step_n, user.loop->params().slew_n_per_ms + 1e-9);
}

// Sequence numbers of mount poses begin anew with a session. The bone goes on from where it is shown.
TEST(FeltMount, GoesOnInAnotherSession) {
  User user({}, true, 1);
  MountPose seen{500, {Vec3(1, 0, 0), Vec3::Zero()}, 0, 0, 0};
  const auto see = [&](std::uint64_t line) {
    for (int i = 0; i < 1000; ++i) {
      if (i % 8 == 0) ++seen.seen_seq, user.mounted.see(line, seen);
      user.tick();
    }
  };
  see(1);
  EXPECT_NEAR(user.mounted.shown().shift().place_mm.x(), 1.0, 1e-2);
  const double before_mm = user.mounted.shown().shift().place_mm.x();
  seen = {0, {Vec3(2, 0, 0), Vec3::Zero()}, 0, 0, 0};
  user.mounted.see(1, seen);
  user.tick();
  EXPECT_NEAR(user.mounted.shown().shift().place_mm.x(), before_mm, 0.1) << "an old sequence number";
  see(2);
  EXPECT_NEAR(user.mounted.shown().shift().place_mm.x(), 2.0, 1e-2);
}

}  // namespace
}  // namespace osteon::haptic
