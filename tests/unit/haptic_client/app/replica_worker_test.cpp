// Tests the replica's thread without a server: joining, own cuts and the room's decisions on them, and its end.
#include "haptic_client/app/replica_worker.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "tests/support/wait.hpp"
#include "tests/unit/haptic_client/app/fake_room.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

using namespace std::chrono_literals;
using osteon::test::wait_until;

class ReplicaWorkerTest : public testing::Test {
 protected:
  ReplicaWorkerTest() {
    worker_.emplace(
        client_room(room_, bone_), session_,
        [this](const Replica& joined) -> Result<void> {
          joined_hash_ = joined.hash();
          if (refuse_) return failure(ErrorCode::invalid_input, "another bone");
          return {};
        },
        exchange_, end_, stop_);
  }
  ~ReplicaWorkerTest() override {
    if (thread_.joinable()) (void)finish();
  }

  // Begins the worker's thread, and joins the room with a bone that nobody has cut.
  void join_room() {
    thread_ = std::thread([this] { worker_->run(); });
    send(RoomAtJoin{RoomSeq{1}, {BodyId{}}, 1});
    EXPECT_TRUE(wait_until([this] { return worker_->joined() || end_.lost(); }, 10s));
  }
  void send(RoomMessage&& message) { EXPECT_TRUE(worker_->queue().push(std::move(message))); }

  // Drills with patches of the uncut bone, until so many cuts were closed.
  void drill(std::uint64_t cuts) {
    Patch patch;
    PatchBuilder builder;
    const Replica bone(bone_, BodyId{});
    SessionTick now = session_.tick(patch, RoomLink::follows);
    for (int i = 0; i < 20'000 && session_.loop().cuts_closed() < cuts; ++i) {
      if (i % 10 == 0)
        builder.build(bone.predicted(), session_.loop().tool(now.report.tool), now.report.pose_bone_proxy, patch);
      now = session_.tick(patch, RoomLink::follows);
    }
    ASSERT_GE(session_.loop().cuts_closed(), cuts);
  }

  ReplicaOutcome finish() {
    worker_->finish();
    thread_.join();
    return worker_->outcome();
  }

  const Case bone_ = block_case();
  FakeRoom room_;
  SimulatedSession session_ = session_of({straight_down("drill-3.2")}, bone_);
  WorkerExchange exchange_;
  ClientEnd end_;
  StopSignal stop_;
  bool refuse_ = false;
  Digest joined_hash_{};
  std::optional<ReplicaWorker> worker_;
  std::thread thread_;
};

TEST_F(ReplicaWorkerTest, HasTheWholeBoneOnceItHasJoined) {
  EXPECT_FALSE(worker_->joined());
  join_room();
  EXPECT_TRUE(worker_->joined());
  const ReplicaOutcome outcome = finish();
  EXPECT_EQ(outcome.field_hash, joined_hash_);
  EXPECT_EQ(outcome.room_seq, RoomSeq{1});
  EXPECT_FALSE(worker_->queue().push(EventNoted{RoomSeq{2}})) << "nobody would take it";
}

TEST_F(ReplicaWorkerTest, EndsTheClientWhenTheBoneIsRefused) {
  refuse_ = true;
  join_room();
  EXPECT_FALSE(worker_->joined());
  EXPECT_FALSE(finish().field_hash);
  ASSERT_TRUE(end_.lost());
  EXPECT_EQ(end_.why()->message, "another bone");
}

TEST_F(ReplicaWorkerTest, SendsOwnCutsAndWaitsUntilTheRoomHasCommittedThem) {
  std::uint64_t seq = 1;
  room_.on_cut = [&](const Cut& cut) { send(CutCommitted{RoomSeq{++seq}, cut}); };
  join_room();
  drill(10);
  const ReplicaOutcome outcome = finish();
  EXPECT_EQ(room_.cuts.size(), session_.loop().cuts_closed());
  EXPECT_EQ(outcome.unconfirmed, 0u);
  EXPECT_EQ(outcome.room_seq, RoomSeq{seq});
  ASSERT_EQ(outcome.cuts.size(), room_.cuts.size());
  for (const RecordedCut& cut : outcome.cuts) EXPECT_GT(cut.room_seq, 1u);
  // The same cuts by another road.
  Replica other(bone_, BodyId{});
  seq = 1;
  for (const Cut& cut : room_.cuts) other.commit(RoomSeq{++seq}, cut, false);
  EXPECT_EQ(outcome.field_hash, other.hash());
  EXPECT_GT(outcome.removed_total_mm3, 0.0);
  EXPECT_DOUBLE_EQ(outcome.removed_mm3.at(0), outcome.removed_total_mm3);
}

TEST_F(ReplicaWorkerTest, DropsWhatTheRoomHasNotConfirmedSoonAfterAStop) {
  join_room();
  drill(3);
  stop_.request();
  const ReplicaOutcome outcome = finish();
  EXPECT_EQ(outcome.unconfirmed, room_.cuts.size());
  EXPECT_EQ(outcome.field_hash, joined_hash_);
  EXPECT_FALSE(end_.lost());
}

TEST_F(ReplicaWorkerTest, EndsTheClientWhenTheRoomRejectsEveryCut) {
  std::uint64_t seq = 1;
  room_.on_cut = [&](const Cut& cut) {
    send(CutRejected{RoomSeq{++seq}, cut.author_seq, 1, Rejection::none, "the room takes no cuts"});
  };
  join_room();
  drill(20);
  const ReplicaOutcome outcome = finish();
  ASSERT_TRUE(end_.lost());
  EXPECT_EQ(end_.why()->message, "the server rejects every cut: the room takes no cuts");
  EXPECT_GE(outcome.rejected, 20u);
  EXPECT_EQ(outcome.field_hash, joined_hash_);
}

TEST_F(ReplicaWorkerTest, NotesAnInstructorsDecisionsAndWhoMadeThem) {
  Restrictions stopped;
  stopped.stopped = true;
  stopped.words = "wait";
  join_room();
  send(HandSupervised{RoomSeq{2}, stopped, 1, {AuthorId{3}, "Weber"}});
  send(HandSupervised{RoomSeq{3}, {}, 1, {AuthorId{3}, "Weber"}});
  const ReplicaOutcome outcome = finish();
  ASSERT_EQ(outcome.decisions.size(), 2u);
  EXPECT_EQ(outcome.decisions[0].by, "Weber");
  EXPECT_EQ(outcome.decisions[1].what, "free");
  ASSERT_EQ(outcome.words.size(), 1u);
  EXPECT_EQ(outcome.words[0].words, "wait");
  EXPECT_TRUE(exchange_.restricted_by.refresh());
  EXPECT_EQ(exchange_.restricted_by.value(), "");
}

TEST_F(ReplicaWorkerTest, KeepsTheBoneOverAnInterruption) {
  join_room();
  send(Interrupted{{ErrorCode::unavailable, "cable"}});
  send(RoomAtJoin{RoomSeq{5}, {BodyId{}}, 2});
  const ReplicaOutcome outcome = finish();
  EXPECT_EQ(outcome.interruptions, 1u);
  EXPECT_EQ(outcome.room_seq, RoomSeq{5});
  EXPECT_EQ(outcome.field_hash, joined_hash_);
}

}  // namespace
}  // namespace osteon::haptic::test
