#include "server/publish/send_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "osteon/v1/cutting.pb.h"
#include "osteon/v1/watch.pb.h"

namespace osteon {
namespace {

BlockKey key_at(int x) { return {BodyId{0}, 0, {x, 0, 0}}; }

// The message of a block, of about `size` bytes.
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

// What a reader holds. Checks that it really holds what each message claims.
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

TEST(MeshSendQueue, ASlowReaderHoldsOneVersionOfEachBlock) {
  MeshUpdate surface;
  for (int x = 0; x < 10; ++x) surface.blocks[key_at(x)] = block(x, 1);
  MeshSendQueue send_queue(surface);
  for (std::uint64_t seq = 1; seq <= 10'000; ++seq) {
    const int x = static_cast<int>(seq % 10);
    send_queue.add({RoomSeq{seq}, {{key_at(x), block(x, seq + 1)}}});
    ASSERT_LE(send_queue.waiting(), 10u);
  }
  Reader reader;
  while (send_queue.waiting() > 0) reader.take(received(send_queue.take()));
  EXPECT_TRUE(send_queue.take().empty());
  EXPECT_EQ(reader.room_seq, 10'000u);
  for (int x = 0; x < 10; ++x) EXPECT_EQ(reader.versions[x], 9'991u + static_cast<unsigned>(x == 0 ? 10 : x));
}

// However many readers stall and however long, only the newest version of each block is held.
TEST(MeshSendQueue, StalledReadersShareOneVersionOfEachBlock) {
  constexpr int kBlocks = 30, kReaders = 150;
  MeshUpdate surface;
  for (int x = 0; x < kBlocks; ++x) surface.blocks[key_at(x)] = block(x, 1);
  std::vector<MeshSendQueue> stalled(kReaders, MeshSendQueue(surface));
  for (MeshSendQueue& send_queue : stalled)
    EXPECT_FALSE(send_queue.take().empty()) << "a message under way that is never finished";
  std::vector<std::weak_ptr<const std::string>> made;
  for (std::uint64_t seq = 1; seq <= 1000; ++seq) {
    const int x = static_cast<int>(seq * 7 % kBlocks);
    MeshUpdate update{RoomSeq{seq}, {{key_at(x), block(x, seq + 1)}}};
    made.push_back(update.blocks.at(key_at(x)));
    for (MeshSendQueue& send_queue : stalled) send_queue.add(update);
  }
  EXPECT_EQ(std::ranges::count_if(made, [](const auto& version) { return !version.expired(); }), kBlocks);
  for (const auto& version : made) {
    const Bytes held = version.lock();
    EXPECT_TRUE(!held || held.use_count() == kReaders + 1) << "the version is shared, not copied";
  }
}

TEST(MeshSendQueue, MessagesAreBoundedAndTheSnapshotEndsOnce) {
  MeshUpdate surface{RoomSeq{7}, {}};
  for (int x = 0; x < 100; ++x) surface.blocks[key_at(x)] = block(x, 1, 30'000);
  MeshSendQueue send_queue(surface);
  Reader reader;
  int messages = 0;
  for (MessageParts parts = send_queue.take(); !parts.empty(); parts = send_queue.take()) {
    const auto message = received(parts);
    EXPECT_LE(message.ByteSizeLong(), MeshSendQueue::kMessageBytes + 100);
    EXPECT_EQ(message.snapshot_blocks(), 100u);
    reader.take(message);
    ++messages;
    EXPECT_EQ(reader.complete, reader.versions.size() == 100);
  }
  EXPECT_EQ(messages, 13);  // 8 blocks of 30 kB fit into 256 kB.
  EXPECT_EQ(reader.room_seq, 7u);
}

TEST(MeshSendQueue, AnEmptySurfaceIsCompleteAtOnceAndEntriesWithoutBlocksAreSent) {
  MeshSendQueue send_queue(MeshUpdate{});
  EXPECT_TRUE(received(send_queue.take()).snapshot_complete());
  EXPECT_TRUE(send_queue.take().empty());
  // A rejected cut changes no block. Its sequence number must still be sent, since somebody may wait for it.
  send_queue.add({RoomSeq{3}, {}});
  EXPECT_EQ(received(send_queue.take()).room_seq(), 3u);
}

TEST(MeshSendQueue, BlocksThatChangeAllTheTimeStarveNoOther) {
  MeshUpdate surface;
  for (int x = 0; x < 40; ++x) surface.blocks[key_at(x)] = block(x, 1, 30'000);
  MeshSendQueue send_queue(surface);
  Reader reader;
  for (std::uint64_t round = 2; round < 20 && !reader.complete; ++round) {
    MeshUpdate busy{RoomSeq{round}, {}};
    for (int x = 0; x < 10; ++x) busy.blocks[key_at(x)] = block(x, round, 30'000);
    send_queue.add(busy);
    reader.take(received(send_queue.take()));
  }
  EXPECT_TRUE(reader.complete);
  for (int x = 0; x < 40; ++x) EXPECT_GE(reader.versions[x], 1u);
}

// For any order of changes and messages: after a message that says "contains room_seq N", the reader has every block at
// least as new as at N.
TEST(MeshSendQueue, ClaimsOnlyWhatTheReaderHolds) {
  std::mt19937 random(11);
  for (int run = 0; run < 50; ++run) {
    std::map<int, std::uint64_t> now;              // version by block
    std::vector<std::map<int, std::uint64_t>> at;  // the same at every room_seq
    MeshUpdate surface;
    for (int x = 0; x < 30; ++x) surface.blocks[key_at(x)] = block(x, now[x] = 1, 20'000);
    at.push_back(now);
    MeshSendQueue send_queue(surface);
    Reader reader;
    for (std::uint64_t seq = 1; seq < 60; ++seq) {
      MeshUpdate update{RoomSeq{seq}, {}};
      for (unsigned n = random() % 4; n > 0; --n) {
        const int x = static_cast<int>(random() % 40);
        if (!update.blocks.contains(key_at(x))) update.blocks[key_at(x)] = block(x, ++now[x], 20'000);
      }
      at.push_back(now);
      send_queue.add(update);
      for (unsigned n = random() % 3; n > 0; --n) {
        const MessageParts parts = send_queue.take();
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

Bytes entry(std::uint64_t seq) {
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

TEST(SessionSendQueue, SendsLeavesThenCompleteThenOnlyTheEntriesAfterThem) {
  SessionSendQueue send_queue;
  send_queue.begin(RoomSeq{4}, {tool()}, complete(4));
  std::vector<FieldLeaf> leaves(2);
  for (FieldLeaf& leaf : leaves) leaf.values.assign(kLeafVoxels, 5);
  leaves[1].origin = {8, 0, 0};
  // The publisher may still enqueue the entry that the leaves already contain.
  EXPECT_TRUE(send_queue.add(RoomSeq{4}, entry(4)));
  EXPECT_TRUE(send_queue.add(RoomSeq{5}, entry(5)));
  EXPECT_TRUE(send_queue.take().empty()) << "nothing is sent before the leaves are known";
  send_queue.set_leaves(leaves);
  EXPECT_TRUE(parsed(send_queue.take()).has_tool()) << "tools are sent before the leaves";
  EXPECT_EQ(parsed(send_queue.take()).leaf().origin().x(), 0);
  EXPECT_EQ(parsed(send_queue.take()).leaf().origin().x(), 8);
  EXPECT_EQ(parsed(send_queue.take()).complete().room_seq(), 4u);
  const v1::SessionResponse first = parsed(send_queue.take());
  EXPECT_EQ(first.committed().room_seq(), 5u);
  EXPECT_EQ(first.index(), 1u) << "the first entry after the leaves";
  EXPECT_TRUE(send_queue.take().empty());
  EXPECT_TRUE(send_queue.add_answer(entry(2))) << "an old outcome is sent again";
  const v1::SessionResponse again = parsed(send_queue.take());
  EXPECT_EQ(again.committed().room_seq(), 2u);
  EXPECT_EQ(again.index(), 0u) << "it is not in the order of this session";
}

// An entry that the reader has received over the other transport is not sent again. Its number is kept.
TEST(SessionSendQueue, LeavesOutWhatHasArrived) {
  SessionSendQueue send_queue;
  send_queue.begin(RoomSeq{0}, {}, complete(0));
  send_queue.set_leaves({});
  (void)send_queue.take();
  for (std::uint64_t seq = 1; seq <= 5; ++seq) EXPECT_TRUE(send_queue.add(RoomSeq{seq}, entry(seq)));
  EXPECT_TRUE(send_queue.add_answer(entry(1)));
  send_queue.arrived(3);
  EXPECT_EQ(send_queue.waiting(), 3u);
  EXPECT_EQ(send_queue.index(), 5u);
  EXPECT_EQ(parsed(send_queue.take()).index(), 4u);
  EXPECT_EQ(parsed(send_queue.take()).index(), 5u);
  EXPECT_EQ(parsed(send_queue.take()).index(), 0u) << "an answer is not in the order of entries";
}

TEST(SessionSendQueue, CountsTheBytesThatWait) {
  const Bytes entry = std::make_shared<const std::string>(300, 'x');
  SessionSendQueue send_queue(1000);
  send_queue.begin(RoomSeq{}, {}, nullptr, 77);
  EXPECT_EQ(send_queue.leaf_bytes(), 77u) << "until they are given";
  for (std::uint64_t seq = 1; seq <= 3; ++seq) EXPECT_TRUE(send_queue.add(RoomSeq{seq}, entry));
  EXPECT_FALSE(send_queue.add(RoomSeq{4}, entry));
  EXPECT_EQ(send_queue.waiting(), 3u);
  FieldLeaf leaf;
  leaf.values.resize(kLeafVoxels);
  send_queue.set_leaves({leaf});
  EXPECT_EQ(send_queue.leaf_bytes(), 1024u);
  EXPECT_FALSE(send_queue.take().empty());
  EXPECT_EQ(send_queue.leaf_bytes(), 0u);
  EXPECT_FALSE(send_queue.take().empty());
  EXPECT_TRUE(send_queue.add(RoomSeq{4}, entry)) << "one was sent";
  EXPECT_FALSE(send_queue.add(RoomSeq{5}, entry));
  (void)send_queue.arrived(3);
  EXPECT_TRUE(send_queue.add(RoomSeq{5}, entry)) << "two have arrived by another way";
}

TEST(SessionSendQueue, GivesUpAReaderThatIsTooFarBehind) {
  SessionSendQueue send_queue;
  send_queue.begin(RoomSeq{0}, {}, complete(0));
  send_queue.set_leaves({});
  std::uint64_t seq = 0;
  while (send_queue.add(RoomSeq{seq + 1}, entry(seq + 1))) ++seq;
  EXPECT_EQ(seq, SessionSendQueue::kMaxEntries);
  EXPECT_EQ(send_queue.waiting(), SessionSendQueue::kMaxEntries);
}

}  // namespace
}  // namespace osteon
