// The threads of the room runtime, with subscribers in place of streams. There is no gRPC in it, so that the thread
// sanitizer can check it.
#include "server/rooms/room_runtime.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <thread>

#include "common/volume/replica.hpp"
#include "common/wire/convert.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/fake_session.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::strokes;

// Maintains a replica from what the stream of a session would carry.
class ReplicaSession final : public test::FakeSession {
 public:
  ReplicaSession(AuthorId author, const Case& bone) : FakeSession(author), replica_(bone, BodyId{0}, tools_) {}
  void begin(SessionStart start) override {
    const std::lock_guard lock(mutex_);
    MessageParts before;
    for (const SessionMessage& message : start.before) before.push_back(message.bytes);
    send_queue_.begin(start.contained, std::move(before), std::move(start.complete));
  }
  void set_leaves(std::vector<FieldLeaf> leaves) override {
    const std::lock_guard lock(mutex_);
    send_queue_.set_leaves(std::move(leaves));
    read();
  }
  void enqueue(const SessionMessage& message) override {
    const std::lock_guard lock(mutex_);
    ASSERT_TRUE(send_queue_.add(message.seq, message.bytes));
    read();
  }
  void decided() override { ++decided_; }
  void end(const std::string&) override { ended_ = true; }

  int decided_cuts() const { return decided_; }
  bool ended() const { return ended_; }
  Digest hash() const {
    const std::lock_guard lock(mutex_);
    return replica_.hash();
  }

 private:
  void read() {
    for (MessageParts parts = send_queue_.take(); !parts.empty(); parts = send_queue_.take()) {
      v1::SessionResponse response;
      ASSERT_TRUE(response.ParseFromString(*parts.front()));
      if (response.has_tool()) tools_->add(wire::from_wire(response.tool().tool()).value());
      if (response.has_leaf()) replica_.restore(wire::from_wire(response.leaf()).value());
      if (response.has_complete()) seq_ = RoomSeq{response.complete().room_seq()};
      if (response.has_change()) take(response.change());
      if (response.has_scene()) seq_ = std::max(seq_, RoomSeq{response.scene().room_seq()});
      if (!response.has_committed()) continue;
      EXPECT_GT(response.committed().room_seq(), seq_.value) << "every entry arrives once and in order";
      replica_.commit(RoomSeq{response.committed().room_seq()}, wire::from_wire(response.committed().cut()).value(),
                      false);
      seq_ = RoomSeq{response.committed().room_seq()};
    }
  }
  void take(const v1::BoneChange& change) {
    std::vector<BodyId> bodies;
    for (const std::uint32_t body : change.bodies()) bodies.push_back(BodyId{body});
    std::vector<FieldLeaf> leaves;
    for (const v1::FieldLeaf& leaf : change.leaves()) leaves.push_back(wire::from_wire(leaf).value());
    EXPECT_GT(change.room_seq(), seq_.value);
    replica_.change(RoomSeq{change.room_seq()}, bodies, leaves);
    if (change.last()) seq_ = RoomSeq{change.room_seq()};
  }

  mutable std::mutex mutex_;
  SessionSendQueue send_queue_;
  std::shared_ptr<ToolBox> tools_ = builtin_tool_box();
  Replica replica_;
  RoomSeq seq_;
  std::atomic<int> decided_{0};
  std::atomic<bool> ended_{false};
};

class FakeMesh final : public MeshSubscriber {
 public:
  void begin(MeshUpdate whole_surface) override { enqueue(whole_surface); }
  void enqueue(const MeshUpdate& update) override {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, bytes] : update.blocks) {
      v1::WatchMeshResponse response;
      ASSERT_TRUE(response.ParseFromString(*bytes));
      if (response.blocks(0).payload().empty())
        hashes_.erase(key);
      else
        hashes_[key] = response.blocks(0).mesh_hash();
    }
  }
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }
  std::map<BlockKey, std::string> hashes() const {
    const std::lock_guard lock(mutex_);
    return hashes_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<BlockKey, std::string> hashes_;
};

TEST(RoomRuntime, EverySubscriberEndsWithTheRoomsBoneAndSurface) {
  const Case bone = test::test_block();
  // Every event shall be a cut. Random strokes can separate debris, which would be an event too, so the detection is
  // off.
  RoomRuntime runtime(Room(bone), {.tick = 1ms, .mesh = 3ms, .pieces = 0ns}, {});
  std::vector<std::shared_ptr<ReplicaSession>> sessions;
  for (int i = 0; i < 3; ++i) {
    sessions.push_back(std::make_shared<ReplicaSession>(runtime.join(MemberKind::surgeon).value(), bone));
    ASSERT_TRUE(runtime.open_session(sessions.back()));
  }
  EXPECT_FALSE(runtime.open_session(sessions.front())) << "one session for each author";
  const auto stranger = std::make_shared<ReplicaSession>(AuthorId{99}, bone);
  EXPECT_FALSE(runtime.open_session(stranger));
  FakeMesh early;
  runtime.watch_mesh(early);

  // Two authors cut at the same time while others join and leave.
  constexpr int kCuts = 60;
  std::vector<std::thread> hands;
  for (unsigned who = 0; who < 2; ++who)
    hands.emplace_back([&, who] {
      for (const Cut& cut : strokes(sessions[who]->author(), kCuts, who)) {
        runtime.queue_cut(sessions[who], cut, RoomRuntime::Clock::now());
        std::this_thread::sleep_for(500us);
      }
    });
  std::vector<std::shared_ptr<ReplicaSession>> late;
  for (int i = 0; i < 5; ++i) {
    late.push_back(std::make_shared<ReplicaSession>(runtime.join(MemberKind::surgeon).value(), bone));
    ASSERT_TRUE(runtime.open_session(late.back()));
    FakeMesh visitor;
    runtime.watch_mesh(visitor);
    std::this_thread::sleep_for(5ms);
    (void)runtime.health();
    runtime.leave(visitor);
  }
  for (std::thread& hand : hands) hand.join();
  runtime.end_streams("over");
  runtime.stop();

  FakeMesh after;
  runtime.watch_mesh(after);
  EXPECT_EQ(early.hashes(), after.hashes());
  const BoneStatus status = runtime.bone_status();
  EXPECT_EQ(status.counts.committed, 2u * kCuts);
  EXPECT_EQ(status.room_seq.value, 2u * kCuts + 3 + 5) << "each join has a sequence number too";
  for (unsigned who = 0; who < 2; ++who) EXPECT_EQ(sessions[who]->decided_cuts(), kCuts);
  for (const auto& list : {sessions, late})
    for (const auto& session : list) {
      EXPECT_EQ(session->hash(), status.field_hash);
      EXPECT_TRUE(session->ended());
      runtime.leave(*session);
    }
  const RuntimeHealth health = runtime.health();
  EXPECT_EQ(health.sessions, 0u);
  EXPECT_EQ(health.counts.committed, 2u * kCuts);
  EXPECT_GT(health.tick.work.count(), 0u);
  EXPECT_GT(health.mesh_update.count(), 0u);
  EXPECT_EQ(health.queued_cuts, 0u);
  runtime.leave(early);
  runtime.leave(after);
}

// The leaves are copied while the room goes on cutting, so some are newer than others. What a session is sent about a
// sequence number must still be true of it.
TEST(RoomRuntime, CopiesOfTheBoneAreRightWhileItIsCut) {
  const Case bone = test::test_block();
  RoomRuntime runtime(Room(bone), {.tick = 200us, .mesh = 50ms, .pieces = 0ns}, {});
  const auto hand = std::make_shared<ReplicaSession>(runtime.join(MemberKind::surgeon).value(), bone);
  ASSERT_TRUE(runtime.open_session(hand));
  constexpr std::uint64_t kCuts = 60;
  std::vector<Cut> cuts = strokes(hand->author(), static_cast<int>(kCuts), 21);
  for (Cut& cut : cuts) cut.level = 1;  // Cheaper to compute, and still several batches of leaves.
  std::thread cutting([&] {
    for (const Cut& cut : cuts) {
      runtime.queue_cut(hand, cut, RoomRuntime::Clock::now());
      std::this_thread::sleep_for(300us);
    }
  });
  std::vector<BoneStatus> said;
  std::vector<std::shared_ptr<ReplicaSession>> late;
  while (runtime.health().counts.committed < kCuts) {
    if (BoneStatus status = runtime.bone_status(); said.empty() || said.back().room_seq < status.room_seq)
      said.push_back(status);
    if (late.size() >= 4) continue;
    late.push_back(std::make_shared<ReplicaSession>(runtime.join(MemberKind::surgeon).value(), bone));
    ASSERT_TRUE(runtime.open_session(late.back()));
  }
  cutting.join();
  runtime.stop();
  said.push_back(runtime.bone_status());

  CutField alone(bone, BodyId{0});
  std::uint64_t applied = 0;
  for (const BoneStatus& status : said) {
    while (applied < status.counts.committed) alone.apply(cuts[applied++]);
    EXPECT_EQ(status.field_hash, alone.hash()) << "at " << applied;
  }
  EXPECT_EQ(applied, kCuts);
  for (const auto& session : late) EXPECT_EQ(session->hash(), alone.hash());
  for (const auto& session : late) runtime.leave(*session);
  runtime.leave(*hand);
}

// Keeps when it was sent a tool's state for the first time.
class FirstState final : public StateSubscriber {
 public:
  void enqueue(const ShownNow& now) override {
    v1::WatchCuttingResponse message;
    ASSERT_TRUE(message.ParseFromString(*now.tools));
    const std::lock_guard lock(mutex_);
    if (!at_ && message.states_size() > 0) at_ = RoomRuntime::Clock::now();
  }
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }
  std::optional<RoomRuntime::Clock::time_point> at() const {
    const std::lock_guard lock(mutex_);
    return at_;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<RoomRuntime::Clock::time_point> at_;
};

CuttingState state_of_a_tool() {
  CuttingState state;
  state.author = AuthorId{1};
  state.state_seq = 1;
  return state;
}

TEST(RoomRuntime, SendsAStateBeforeItsTick) {
  // As long as a loaded machine may take for a thread, and no longer: the runtime ends with a tick.
  constexpr auto kTick = 3s;
  FirstState reader;
  const RoomRuntime::Clock::time_point first_tick = RoomRuntime::Clock::now() + kTick;  // or later
  RoomRuntime runtime(Room(test::test_block()), {.tick = kTick, .mesh = 3ms, .pieces = 0ns}, {});
  runtime.watch_cutting(reader);
  runtime.publish_state(state_of_a_tool());
  runtime.stop();
  runtime.leave(reader);
  ASSERT_TRUE(reader.at());
  EXPECT_LT(*reader.at(), first_tick);
}

TEST(RoomRuntime, SendsNoStateBeforeTheTickOfADrivenRoom) {
  for (const bool ticks : {false, true}) {
    FirstState reader;
    RoomRuntime runtime(Room(test::test_block()), {.tick = 0ns, .mesh = 1s, .pieces = 0ns}, {});
    runtime.watch_cutting(reader);
    runtime.publish_state(state_of_a_tool());
    if (ticks) runtime.tick(10ms);
    runtime.stop();  // sends what is due
    runtime.leave(reader);
    EXPECT_EQ(reader.at().has_value(), ticks);
  }
}

}  // namespace
}  // namespace osteon
