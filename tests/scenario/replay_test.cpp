// Replays recorded sessions. Every way to apply their cuts to a bone must give the recorded field.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <thread>

#include "common/volume/replica.hpp"
#include "server/room/room.hpp"
#include "tests/scenario/recording.hpp"
#include "tests/support/shared_data.hpp"

namespace osteon::test {
namespace {

Recording recorded() {
  const auto recording = read_recording(source_dir() / "tests" / "scenario" / "recordings" / "drill_and_burr");
  EXPECT_TRUE(recording) << recording.error().message;
  return recording ? *recording : Recording{};
}

TEST(Replay, ARoomComesToTheRecordedField) {
  const Recording session = recorded();
  ASSERT_GT(session.cuts.size(), 100u);
  Room room(recorded_bone());
  const AuthorId author = room.join(MemberKind::surgeon);
  for (Cut cut : session.cuts) {
    cut.author = author;
    cut.lease_epoch = room.lease_epoch(cut.author);
    const auto outcome = room.submit(cut);
    ASSERT_TRUE(outcome) << outcome.error().message;
    ASSERT_TRUE(outcome->committed());
  }
  EXPECT_EQ(to_hex(room.field_hash()), to_hex(session.field_hash));
  EXPECT_EQ(room.room_seq().value, session.cuts.size() + 1) << "a join has a sequence number too";
}

TEST(Replay, AnyOrderAndRepetitionComesToTheRecordedField) {
  Recording session = recorded();
  std::mt19937 random(23);
  for (int order = 0; order < 3; ++order) {
    std::ranges::shuffle(session.cuts, random);
    CutField field(recorded_bone(), {});
    for (std::size_t i = 0; i < session.cuts.size(); ++i) {
      field.apply(session.cuts[i]);
      field.apply(session.cuts[i / 2]);
    }
    EXPECT_EQ(to_hex(field.hash()), to_hex(session.field_hash));
  }
}

// Two surgeons make half of the cuts each, at the same time. Their replicas receive the other's cuts late.
TEST(Replay, TwoReplicasThatHearOfEachOtherLateComeToTheRecordedField) {
  const Recording session = recorded();
  Room room(recorded_bone());
  struct Surgeon {
    AuthorId author;
    Replica replica;
    std::uint64_t author_seq = 0;
    std::size_t heard = 0;
  };
  const Case bone = recorded_bone();
  std::vector<Surgeon> surgeons;
  for (int i = 0; i < 2; ++i) surgeons.push_back({room.join(MemberKind::surgeon), Replica(bone, {})});
  std::vector<Cut> committed;
  const auto hear = [&](Surgeon& surgeon, std::size_t until) {
    for (; surgeon.heard < until; ++surgeon.heard)
      surgeon.replica.commit(RoomSeq{surgeon.heard + 1}, committed[surgeon.heard],
                             committed[surgeon.heard].author == surgeon.author);
  };
  for (std::size_t i = 0; i < session.cuts.size(); ++i) {
    Surgeon& surgeon = surgeons[i % 2];
    Cut cut = session.cuts[i];
    cut.author = surgeon.author;
    cut.author_seq = ++surgeon.author_seq;
    cut.lease_epoch = room.lease_epoch(cut.author);
    surgeon.replica.add_own(cut);
    ASSERT_TRUE(room.submit(cut)->committed());
    committed.push_back(cut);
    hear(surgeons[0], i > 5 ? i - 5 : 0);
    hear(surgeons[1], i > 31 ? i - 31 : 0);
  }
  for (Surgeon& surgeon : surgeons) {
    hear(surgeon, committed.size());
    EXPECT_EQ(to_hex(surgeon.replica.committed().hash()), to_hex(session.field_hash));
    EXPECT_EQ(to_hex(surgeon.replica.predicted().hash()), to_hex(session.field_hash));
    EXPECT_EQ(surgeon.replica.unconfirmed(), 0u);
  }
  EXPECT_EQ(to_hex(room.field_hash()), to_hex(session.field_hash));
}

TEST(Replay, ThreadsThatShareACaseDoNotDisturbEachOther) {
  const Recording session = recorded();
  const Case bone = recorded_bone();
  std::array<Digest, 2> hashes;
  {
    std::vector<std::jthread> threads;
    for (Digest& hash : hashes)
      threads.emplace_back([&] {
        CutField field(bone, {});
        for (const Cut& cut : session.cuts) field.apply(cut);
        hash = field.hash();
      });
  }
  for (const Digest& hash : hashes) EXPECT_EQ(to_hex(hash), to_hex(session.field_hash));
}

TEST(Replay, ASessionThatStopsHalfWayIsAnotherField) {
  const Recording session = recorded();
  CutField field(recorded_bone(), {});
  for (std::size_t i = 0; i < session.cuts.size() / 2; ++i) field.apply(session.cuts[i]);
  EXPECT_NE(to_hex(field.hash()), to_hex(session.field_hash));
}

}  // namespace
}  // namespace osteon::test
