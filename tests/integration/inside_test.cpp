// An observer who comes late holds the bone of a room in which two people drill. Server and hands are processes.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/integration/stage.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/rooms/members.hpp"
#include "viewer_client/net/room_subscription.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// More holes than the observer needs.
json plan_beside(double x_mm) {
  json steps = json::array();
  for (const double y_mm : {0.0, 8.0, -8.0, 16.0, -16.0}) steps.push_back(drill_at(x_mm, y_mm, "expert"));
  return {{"steps", steps}};
}

// Whether the observer holds what the server has, at the same event.
bool holds_the_servers_bone(const RoomSubscription& observer) {
  const v1::GetStatusResponse server = status_of(observer.joined());
  bool same = false;
  const bool there = observer.held_bone()->read([&](const Replica& bone) {
    same = bone.room_seq().value == server.room_seq() && wire::to_wire(bone.hash()) == server.field_hash() &&
           bone.bodies().size() == static_cast<std::size_t>(server.bodies_size());
  });
  return there && same;
}

TEST(Inside, AnObserverWhoComesLateHoldsTheBoneThatTwoPeopleDrill) {
  Stage stage;
  Process anna = stage.start_haptic("anna", plan_beside(-8.0)), ben = stage.start_haptic("ben", plan_beside(8.0));
  ASSERT_TRUE(stage.is_at_work("anna") && stage.is_at_work("ben")) << anna.err() << ben.err();
  RenderQueue queue;
  auto joined =
      RoomSubscription::start({.address = stage.address(), .cache = stage / "observers"}, queue, [] { return false; });
  ASSERT_TRUE(joined) << joined.error().message;
  RoomSubscription& observer = **joined;
  const std::uint64_t at_the_join = status_of(observer.joined()).room_seq();
  EXPECT_EQ(observer.held_bone(), nullptr);
  EXPECT_FALSE(std::filesystem::exists(stage / "observers")) << "what nobody wants is not fetched";

  observer.hold_bone(true);
  const auto held = observer.held_bone();
  ASSERT_NE(held, nullptr);
  // It follows while they go on.
  ASSERT_TRUE(held->wait(
      [&](const HeldBoneStatus& now) {
        return now.state == HeldBoneState::follows && now.room_seq.value > at_the_join + 100;
      },
      60s))
      << anna.err() << ben.err();
  EXPECT_GT(held->status().bytes, 0u);
  for (Process* hand : {&anna, &ben}) ASSERT_TRUE(hand->terminate(20s).has_value());
  ASSERT_TRUE(wait_until([&] { return holds_the_servers_bone(observer); }, 60s));
  Digest drilled;
  double removed_mm3 = 0.0;
  ASSERT_TRUE(held->read([&](const Replica& bone) { drilled = bone.hash(), removed_mm3 = bone.removed_mm3(); }));
  // Who ended last has every cut: its summary is the bone of a third program.
  const json last = read_json(stage / "ben.json");
  EXPECT_EQ(last.at("unconfirmed"), 0);
  EXPECT_EQ(last.at("field_hash"), to_hex(drilled));
  // Two drills of 3.2 mm in 5 mm of cortex: at least half of one such hole.
  EXPECT_GT(removed_mm3, 0.5 * 3.14 * 1.6 * 1.6 * 5.0);

  // Undo brings bone back, for the observer too.
  ASSERT_TRUE(observer.undo(60));
  ASSERT_TRUE(wait_until([&] { return holds_the_servers_bone(observer); }, 60s));
  Digest undone;
  double less_mm3 = 0.0;
  ASSERT_TRUE(held->read([&](const Replica& bone) { undone = bone.hash(), less_mm3 = bone.removed_mm3(); }));
  EXPECT_NE(undone, drilled);
  EXPECT_LT(less_mm3, removed_mm3);
  EXPECT_EQ(held->status().asked_again, 0u) << "an undo is an event like others";

  // The server's own summary.
  observer.end();
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  EXPECT_EQ(read_json(stage / "server.json").at("field_hash"), to_hex(undone));
}

// The case is on disk, so the second server continues the journal. The observer finds it by itself.
TEST(Inside, AnObserverHoldsTheBoneAgainAfterTheServerWasKilled) {
  const TempDir kept;
  const std::string journal = (kept / "room.journal").string();
  Stage stage(24.0, {"--plain", "--journal", journal});
  RenderQueue queue;
  auto joined = RoomSubscription::start({.address = stage.address(), .keep_trying = true, .cache = stage / "observers"},
                                        queue, [] { return false; });
  ASSERT_TRUE(joined) << joined.error().message;
  RoomSubscription& observer = **joined;
  observer.hold_bone(true);
  const auto held = observer.held_bone();
  Process anna = stage.start_haptic("anna", {{"steps", {drill_at(0.0, 0.0, "expert")}}});
  ASSERT_TRUE(stage.is_at_work("anna")) << anna.err();
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.room_seq.value > 50; }, 60s));
  const std::string address = stage.address();
  ASSERT_TRUE(anna.terminate(20s).has_value());
  ASSERT_TRUE(wait_until([&] { return holds_the_servers_bone(observer); }, 60s));
  Digest before;
  ASSERT_TRUE(held->read([&](const Replica& bone) { before = bone.hash(); }));
  stage.server().signal(SIGKILL);
  (void)stage.server().wait(20s);
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::interrupted; }, 60s));
  EXPECT_TRUE(held->read([&](const Replica& bone) { EXPECT_EQ(bone.hash(), before); })) << "pictures go on";
  stage.start_server({"--plain", "--journal", journal, "--listen", address});
  ASSERT_TRUE(held->wait([](const HeldBoneStatus& now) { return now.state == HeldBoneState::follows; }, 60s));
  ASSERT_TRUE(wait_until([&] { return holds_the_servers_bone(observer); }, 60s));
  EXPECT_TRUE(held->read([&](const Replica& bone) { EXPECT_EQ(bone.hash(), before); }));
  EXPECT_GE(held->status().asked_again, 1u);
}

}  // namespace
}  // namespace osteon::test
