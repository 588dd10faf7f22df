#include "server/net/outbox.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "osteon/v1/cutting.pb.h"
#include "osteon/v1/watch.pb.h"

namespace osteon {
namespace {

BlockKey key_at(int x) { return {BodyId{0}, 0, {x, 0, 0}}; }

// A block's message of about `size` bytes.
Bytes block(int x, std::uint64_t version, std::size_t size = 100) {
  v1::WatchMeshResponse response;
  v1::MeshBlock& out = *response.add_blocks();
  out.mutable_index()->set_x(x);
  out.set_version(version);
  out.set_payload(std::string(size, 'b'));
  return std::make_shared<const std::string>(response.SerializeAsString());
}

v1::WatchMeshResponse received(const MessageParts& parts) {
  std::string whole;
  for (const Bytes& part : parts) whole += *part;
  v1::WatchMeshResponse response;
  EXPECT_TRUE(response.ParseFromString(whole));
  return response;
}

// What a reader holds, and whether what a message claims is true of it.
struct Reader {
  std::map<int, std::uint64_t> versions;
  std::uint64_t room_seq = 0;
  bool complete = false;
  void take(const v1::WatchMeshResponse& message) {
    for (const v1::MeshBlock& b : message.blocks()) {
      EXPECT_GT(b.version(), versions[b.index().x()]) << "an old version after a newer one";
      versions[b.index().x()] = b.version();
    }
    EXPECT_GE(message.room_seq(), room_seq);
    EXPECT_TRUE(message.snapshot_complete() || !complete);
    room_seq = message.room_seq();
    complete = message.snapshot_complete();
  }
};

TEST(MeshOutbox, ASlowReaderHoldsOneVersionOfEachBlock) {
  MeshUpdate surface;
  for (int x = 0; x < 10; ++x) surface.blocks[key_at(x)] = block(x, 1);
  MeshOutbox outbox(surface);
  for (std::uint64_t seq = 1; seq <= 10'000; ++seq) {
    const int x = static_cast<int>(seq % 10);
    outbox.add({RoomSeq{seq}, {{key_at(x), block(x, seq + 1)}}});
    ASSERT_LE(outbox.waiting(), 10u);
  }
  Reader reader;
  while (outbox.waiting() > 0) reader.take(received(outbox.take()));
  EXPECT_TRUE(outbox.take().empty());
  EXPECT_EQ(reader.room_seq, 10'000u);
  for (int x = 0; x < 10; ++x) EXPECT_EQ(reader.versions[x], 9'991u + static_cast<unsigned>(x == 0 ? 10 : x));
}

// However many readers stall and however long: of every block, its newest version is all that is held.
TEST(MeshOutbox, StalledReadersShareOneVersionOfEachBlock) {
  constexpr int kBlocks = 30, kReaders = 150;
  MeshUpdate surface;
  for (int x = 0; x < kBlocks; ++x) surface.blocks[key_at(x)] = block(x, 1);
  std::vector<MeshOutbox> stalled(kReaders, MeshOutbox(surface));
  for (MeshOutbox& outbox : stalled) EXPECT_FALSE(outbox.take().empty()) << "a message in flight, never finished";
  std::vector<std::weak_ptr<const std::string>> made;
  for (std::uint64_t seq = 1; seq <= 1000; ++seq) {
    const int x = static_cast<int>(seq * 7 % kBlocks);
    MeshUpdate update{RoomSeq{seq}, {{key_at(x), block(x, seq + 1)}}};
    made.push_back(update.blocks.at(key_at(x)));
    for (MeshOutbox& outbox : stalled) outbox.add(update);
  }
  EXPECT_EQ(std::ranges::count_if(made, [](const auto& version) { return !version.expired(); }), kBlocks);
  for (const auto& version : made) {
    const Bytes held = version.lock();
    EXPECT_TRUE(!held || held.use_count() == kReaders + 1) << "shared, never copied";
  }
}

TEST(MeshOutbox, MessagesAreBoundedAndTheSnapshotEndsOnce) {
  MeshUpdate surface{RoomSeq{7}, {}};
  for (int x = 0; x < 100; ++x) surface.blocks[key_at(x)] = block(x, 1, 30'000);
  MeshOutbox outbox(surface);
  Reader reader;
  int messages = 0;
  for (MessageParts parts = outbox.take(); !parts.empty(); parts = outbox.take()) {
    const auto message = received(parts);
    EXPECT_LE(message.ByteSizeLong(), MeshOutbox::kMessageBytes + 100);
    EXPECT_EQ(message.snapshot_blocks(), 100u);
    reader.take(message);
    ++messages;
    EXPECT_EQ(reader.complete, reader.versions.size() == 100);
  }
  EXPECT_EQ(messages, 13);  // 8 blocks of 30 kB fit into 256 kB
  EXPECT_EQ(reader.room_seq, 7u);
}

TEST(MeshOutbox, AnEmptySurfaceIsCompleteAtOnceAndRowsWithoutBlocksAreTold) {
  MeshOutbox outbox(MeshUpdate{});
  EXPECT_TRUE(received(outbox.take()).snapshot_complete());
  EXPECT_TRUE(outbox.take().empty());
  outbox.add({RoomSeq{3}, {}});  // a rejected cut changes no block, yet who waits for its place must hear of it
  EXPECT_EQ(received(outbox.take()).room_seq(), 3u);
}

TEST(MeshOutbox, BlocksThatChangeAllTheTimeStarveNoOther) {
  MeshUpdate surface;
  for (int x = 0; x < 40; ++x) surface.blocks[key_at(x)] = block(x, 1, 30'000);
  MeshOutbox outbox(surface);
  Reader reader;
  for (std::uint64_t round = 2; round < 20 && !reader.complete; ++round) {
    MeshUpdate busy{RoomSeq{round}, {}};
    for (int x = 0; x < 10; ++x) busy.blocks[key_at(x)] = block(x, round, 30'000);
    outbox.add(busy);
    reader.take(received(outbox.take()));
  }
  EXPECT_TRUE(reader.complete);
  for (int x = 0; x < 40; ++x) EXPECT_GE(reader.versions[x], 1u);
}

// Whatever order changes and messages come in: a message that says "contains room_seq N" leaves the reader with every
// block at least as new as at N.
TEST(MeshOutbox, ClaimsOnlyWhatTheReaderHolds) {
  std::mt19937 random(11);
  for (int run = 0; run < 50; ++run) {
    std::map<int, std::uint64_t> now;                             // version by block
    std::vector<std::map<int, std::uint64_t>> at;                 // the same at every room_seq
    MeshUpdate surface;
    for (int x = 0; x < 30; ++x) surface.blocks[key_at(x)] = block(x, now[x] = 1, 20'000);
    at.push_back(now);
    MeshOutbox outbox(surface);
    Reader reader;
    for (std::uint64_t seq = 1; seq < 60; ++seq) {
      MeshUpdate update{RoomSeq{seq}, {}};
      for (unsigned n = random() % 4; n > 0; --n) {
        const int x = static_cast<int>(random() % 40);
        if (!update.blocks.contains(key_at(x))) update.blocks[key_at(x)] = block(x, ++now[x], 20'000);
      }
      at.push_back(now);
      outbox.add(update);
      for (unsigned n = random() % 3; n > 0; --n) {
        const MessageParts parts = outbox.take();
        if (parts.empty()) break;
        reader.take(received(parts));
        if (!reader.complete) continue;
        for (const auto& [x, version] : at[reader.room_seq]) ASSERT_GE(reader.versions[x], version);
      }
    }
  }
}

Bytes complete(std::uint64_t seq) {
  v1::SessionResponse response;
  response.mutable_complete()->set_room_seq(seq);
  return std::make_shared<const std::string>(response.SerializeAsString());
}

Bytes tool() {
  v1::SessionResponse response;
  response.mutable_tool();
  return std::make_shared<const std::string>(response.SerializeAsString());
}

Bytes row(std::uint64_t seq) {
  v1::SessionResponse response;
  response.mutable_committed()->set_room_seq(seq);
  return std::make_shared<const std::string>(response.SerializeAsString());
}

v1::SessionResponse parsed(const MessageParts& parts) {
  v1::SessionResponse response;
  std::string all;
  for (const Bytes& part : parts) all += *part;
  EXPECT_TRUE(response.ParseFromString(all));
  return response;
}

TEST(SessionOutbox, SendsLeavesThenCompleteThenOnlyTheRowsAfterThem) {
  SessionOutbox outbox;
  outbox.begin(RoomSeq{4}, {tool()}, complete(4));
  std::vector<FieldLeaf> leaves(2);
  for (FieldLeaf& leaf : leaves) leaf.values.assign(kLeafVoxels, 5);
  leaves[1].origin = {8, 0, 0};
  // The publisher may still bring the row that the leaves already contain.
  EXPECT_TRUE(outbox.add(RoomSeq{4}, row(4)));
  EXPECT_TRUE(outbox.add(RoomSeq{5}, row(5)));
  EXPECT_TRUE(outbox.take().empty()) << "nothing before the leaves are known";
  outbox.set_leaves(leaves);
  EXPECT_TRUE(parsed(outbox.take()).has_tool()) << "tools go before the leaves";
  EXPECT_EQ(parsed(outbox.take()).leaf().origin().x(), 0);
  EXPECT_EQ(parsed(outbox.take()).leaf().origin().x(), 8);
  EXPECT_EQ(parsed(outbox.take()).complete().room_seq(), 4u);
  const v1::SessionResponse first = parsed(outbox.take());
  EXPECT_EQ(first.committed().room_seq(), 5u);
  EXPECT_EQ(first.index(), 1u) << "the first after the leaves";
  EXPECT_TRUE(outbox.take().empty());
  EXPECT_TRUE(outbox.add_answer(row(2))) << "an old outcome told again";
  const v1::SessionResponse again = parsed(outbox.take());
  EXPECT_EQ(again.committed().room_seq(), 2u);
  EXPECT_EQ(again.index(), 0u) << "it has no place in the order of this session";
}

// What a reader has had by another way is not sent again; its numbers stay.
TEST(SessionOutbox, LeavesOutWhatHasArrived) {
  SessionOutbox outbox;
  outbox.begin(RoomSeq{0}, {}, complete(0));
  outbox.set_leaves({});
  (void)outbox.take();
  for (std::uint64_t seq = 1; seq <= 5; ++seq) EXPECT_TRUE(outbox.add(RoomSeq{seq}, row(seq)));
  EXPECT_TRUE(outbox.add_answer(row(1)));
  outbox.arrived(3);
  EXPECT_EQ(outbox.waiting(), 3u);
  EXPECT_EQ(outbox.index(), 5u);
  EXPECT_EQ(parsed(outbox.take()).index(), 4u);
  EXPECT_EQ(parsed(outbox.take()).index(), 5u);
  EXPECT_EQ(parsed(outbox.take()).index(), 0u) << "an answer is not a row of the order";
}

TEST(SessionOutbox, GivesUpAReaderThatIsTooFarBehind) {
  SessionOutbox outbox;
  outbox.begin(RoomSeq{0}, {}, complete(0));
  outbox.set_leaves({});
  std::uint64_t seq = 0;
  while (outbox.add(RoomSeq{seq + 1}, row(seq + 1))) ++seq;
  EXPECT_EQ(seq, SessionOutbox::kMaxRows);
  EXPECT_EQ(outbox.waiting(), SessionOutbox::kMaxRows);
}

}  // namespace
}  // namespace osteon
