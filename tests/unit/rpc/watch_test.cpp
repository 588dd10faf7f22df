// Viewers of a served room that join, leave, stall and come back. All end with the room's surface.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/unit/rooms/served_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using Watching = test::ServedRoom;

Digest hash_of(const MeshReader& reader) {
  std::map<BlockKey, Digest> hashes;
  for (const auto& [key, hash] : reader.hashes()) hashes[key] = wire::digest_from_wire(hash).value();
  return surface_hash(hashes);
}

TEST_F(Watching, WhoeverComesGoesStallsOrComesBackEndsWithTheRoomsSurface) {
  const auto hand = surgeon();
  std::vector<std::unique_ptr<MeshReader>> readers;
  for (int i = 0; i < 4; ++i)
    readers.push_back(std::make_unique<MeshReader>(address()));  // Two of them read only at the end.
  std::atomic<bool> cutting{true};
  std::atomic<int> comings{0};
  std::vector<std::thread> people;
  for (int i = 0; i < 2; ++i)
    people.emplace_back([&, i] {
      for (std::uint64_t seq = 20; seq < 380; seq += 20) EXPECT_TRUE(readers[i]->read_to(RoomSeq{seq}));
    });
  // A viewer whose stream ends sometimes, in the middle of a surface or after it.
  people.emplace_back([&] {
    while (cutting || comings < 4) {
      MeshReader again(address());
      EXPECT_TRUE(comings++ % 2 || again.read_to(server_->health().room_seq));
    }
  });
  constexpr int kCuts = 400, kLast = 10;
  const std::vector<Cut> cuts = strokes(hand->author(), kCuts, 21);
  for (int i = 0; i < kCuts - kLast; ++i) {
    send(*hand, {cuts[i]});
    if (i % 100 == 50) readers.push_back(std::make_unique<MeshReader>(address()));  // These join late, during the cuts.
    std::this_thread::sleep_for(1ms);
  }
  cutting = false;
  for (std::thread& person : people) person.join();
  readers.push_back(std::make_unique<MeshReader>(address()));
  // Nobody joins any more: the remaining entries are those that the haptic client receives.
  send(*hand, {cuts.end() - kLast, cuts.end()});
  ASSERT_TRUE(wait_until([&] { return hand->own() == kCuts; }, kPatience));
  // Debris may still separate. Each piece of it is an event of its own.
  ASSERT_TRUE(wait_until([&] { return settled(runtime(), {hand.get()}); }, kPatience));
  const RoomSeq last = server_->health().room_seq;
  for (const auto& reader : readers) EXPECT_TRUE(reader->read_to(last));
  const std::size_t blocks = server_->health().blocks;
  const Digest surface = server_->stop().surface_hash;
  server_.reset();
  for (const auto& reader : readers) {
    EXPECT_EQ(reader->hashes().size(), blocks);
    EXPECT_EQ(hash_of(*reader), surface);
  }
}

TEST_F(Watching, WhoWantsStatesSeldomIsSentFewAndTheLast) {
  const auto hand = surgeon();
  const wire::JoinedRoom room = join(address(), wire::ClientKind::viewer);
  v1::WatchCuttingRequest request;
  request.set_author(room.author.value);
  request.set_most_hz(20);
  grpc::ClientContext context;
  const auto start = std::chrono::steady_clock::now();
  const auto stream = v1::WatchService::NewStub(room.channel)->WatchCutting(&context, request);
  constexpr std::uint64_t kStates = 300;
  std::thread hands([&] {
    CuttingState state;
    state.author = hand->author();
    state.tool_name = "drill-3.2";
    for (state.state_seq = 1; state.state_seq <= kStates; ++state.state_seq) {
      hand->session().send(state);
      std::this_thread::sleep_for(2ms);
    }
  });
  v1::WatchCuttingResponse message;
  int messages = 0;
  std::uint64_t newest = 0;
  while (newest < kStates && stream->Read(&message)) {
    ++messages;
    if (message.states_size() > 0) newest = message.states(0).state_seq();
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  hands.join();
  EXPECT_EQ(newest, kStates);
  EXPECT_LE(messages, 20.0 * took.count() + 3.0) << "one more at the join, and one turn that comes early";
  context.TryCancel();
  stream->Finish();
}

}  // namespace
}  // namespace osteon
