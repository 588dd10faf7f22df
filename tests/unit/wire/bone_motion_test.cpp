// The motion of a mounted bone on the wire, and at both ends of the fast path.
#include "common/wire/bone_motion.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <map>
#include <optional>

#include "tests/unit/wire/link_trial.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::Time;
using test::Trial;

MountLoad some_push(std::uint64_t seq) {
  return {seq, {{1.2345678, -40.0, 0.0004}, {-300.126, 0.0, 19999.5}}, 12.3459, 17};
}

MountPose some_pose(std::uint64_t seq) { return {seq, {{0.25, -3.0, 1e-5}, {0.1, -0.2, 0.0}}, 0.9999, 4, 0.1504}; }

TEST(BoneOnTheWire, ComesBackWithinHalfAStep) {
  const Result<MountLoad> push = wire::from_wire(wire::to_wire(some_push(3)));
  ASSERT_TRUE(push.has_value()) << push.error().message;
  EXPECT_EQ(push->push_seq, 3u);
  EXPECT_EQ(push->seen_seq, 17u);
  EXPECT_LE((push->load.force_n - some_push(3).load.force_n).cwiseAbs().maxCoeff(), 0.5e-3);
  EXPECT_LE((push->load.moment_nmm - some_push(3).load.moment_nmm).cwiseAbs().maxCoeff(), 0.5e-2);

  const Result<MountPose> seen = wire::from_wire(wire::to_wire(some_pose(5)));
  ASSERT_TRUE(seen.has_value()) << seen.error().message;
  EXPECT_EQ(seen->seen_seq, 5u);
  EXPECT_EQ(seen->push_seq, 4u);
  EXPECT_LE((seen->shift.place_mm - some_pose(5).shift.place_mm).cwiseAbs().maxCoeff(), 0.5 / 65536);
  EXPECT_LE((seen->shift.turn_rad - some_pose(5).shift.turn_rad).cwiseAbs().maxCoeff(), 0.5 / 1048576);
  EXPECT_DOUBLE_EQ(seen->lag_s, 0.150);
}

// Rounding up would add energy that nobody put in.
TEST(BoneOnTheWire, RoundsEnergyDown) {
  for (const double mj : {0.0, 0.0004, 0.0019999, 12.3459, 1e6 + 0.00099}) {
    MountLoad push = some_push(1);
    MountPose seen = some_pose(1);
    push.energy_mj = seen.energy_mj = mj;
    for (const double came :
         {wire::from_wire(wire::to_wire(push))->energy_mj, wire::from_wire(wire::to_wire(seen))->energy_mj}) {
      EXPECT_LE(came, mj);
      EXPECT_GT(came, mj - 0.0011);
    }
  }
  for (const double wrong : {-5.0, std::numeric_limits<double>::quiet_NaN()}) {
    MountLoad push = some_push(1);
    push.energy_mj = push.load.force_n.x() = wrong;
    EXPECT_EQ(wire::from_wire(wire::to_wire(push))->energy_mj, 0.0);
  }
}

// For each field: a value that no correct peer sends, and the field's name in the error.
TEST(BoneOnTheWire, RefusesWhatNoPeerSends) {
  const std::map<std::string, std::function<void(v1::MountLoad&)>> pushes{
      {"push_seq", [](auto& m) { m.set_push_seq(0); }},
      {"force", [](auto& m) { m.mutable_force()->RemoveLast(); }},
      {"moment", [](auto& m) { m.add_moment(1); }},
      {"energy", [](auto& m) { m.set_energy(-1); }},
  };
  for (const auto& [field, spoil] : pushes) {
    v1::MountLoad message = wire::to_wire(some_push(1));
    spoil(message);
    const Result<MountLoad> read = wire::from_wire(message);
    ASSERT_FALSE(read.has_value()) << field;
    EXPECT_EQ(read.error().code, ErrorCode::invalid_input);
    EXPECT_NE(read.error().message.find("push." + field), std::string::npos) << read.error().message;
  }
  const std::map<std::string, std::function<void(v1::MountPose&)>> poses{
      {"seen_seq", [](auto& m) { m.set_seen_seq(0); }},
      {"place", [](auto& m) { m.clear_place(); }},
      {"turn", [](auto& m) { m.set_turn(1, 4 << 20); }},
      {"energy", [](auto& m) { m.set_energy(std::numeric_limits<std::int64_t>::max()); }},
      {"lag_ms", [](auto& m) { m.set_lag_ms(60'001); }},
  };
  for (const auto& [field, spoil] : poses) {
    v1::MountPose message = wire::to_wire(some_pose(1));
    spoil(message);
    const Result<MountPose> read = wire::from_wire(message);
    ASSERT_FALSE(read.has_value()) << field;
    EXPECT_NE(read.error().message.find("bone." + field), std::string::npos) << read.error().message;
  }
}

// Both ends, on a network that loses 30 % and reorders. The newest wins. None arrives twice. At most one is sent in
// 8 ms.
TEST(BoneOnTheLink, TheNewestWins) {
  Trial trial({.quality = test::hostile(40ms), .long_cuts = 0, .events = 0});
  wire::ClientLink& client = trial.clients[0]->link;
  wire::ServerLink& server = trial.sessions[0]->link;
  trial.time.run_until(600ms);
  ASSERT_TRUE(client.alive(trial.time.now()) && server.alive(trial.time.now()));
  trial.cut(true);
  std::uint64_t pushed = 0, bones_set = 0, push_received = 0, bone_received = 0, pushes = 0, bones = 0;
  for (Time now = 600ms; now < 2600ms; now += 2ms) {
    client.set_push(some_push(++pushed));
    server.set_bone(some_pose(++bones_set));
    trial.time.run_until(now);
    if (const auto push = server.take_push()) {
      EXPECT_GT(push->push_seq, push_received);
      push_received = push->push_seq;
      ++pushes;
      EXPECT_FALSE(server.take_push());
    }
    if (const auto bone = client.take_bone()) {
      EXPECT_GT(bone->seen_seq, bone_received);
      bone_received = bone->seen_seq;
      ++bones;
    }
  }
  // Each end set a thousand in two seconds.
  EXPECT_LE(pushes, 250u);
  EXPECT_LE(bones, 250u);
  EXPECT_GE(pushes, 60u);
  EXPECT_GE(bones, 60u);
  trial.time.run_until(2900ms);
  if (const auto push = server.take_push()) push_received = push->push_seq;
  if (const auto bone = client.take_bone()) bone_received = bone->seen_seq;
  EXPECT_GE(push_received + 50, pushed);
  EXPECT_GE(bone_received + 50, bones_set);
  trial.cut(false);
  trial.settle(8s);
  EXPECT_TRUE(trial.settled() && trial.exact());
  // The other session has no mount, and receives no motion.
  EXPECT_FALSE(trial.clients[1]->link.take_bone());
  EXPECT_FALSE(trial.sessions[1]->link.take_push());
}

}  // namespace
}  // namespace osteon
