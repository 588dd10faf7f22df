// What a session is sent at its beginning, and when: nothing that a killed room would have lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "osteon/v1/cutting.pb.h"
#include "server/rooms/room_runtime.hpp"
#include "server/storage/room_store.hpp"
#include "tests/support/disk/memory_disk.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/fake_session.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::strokes;
using test::test_block;

const Digest kSecret{{7}};

// Keeps what its reader is sent at once, as over a connection that takes everything.
class ReceivedAtOnce final : public test::FakeSession {
 public:
  using FakeSession::FakeSession;
  void begin(SessionStart start) override {
    MessageParts before;
    for (const SessionMessage& message : start.before) before.push_back(message.bytes);
    send_queue_.begin(start.contained, std::move(before), std::move(start.complete));
    read();
  }
  void set_leaves(std::vector<FieldLeaf> leaves) override {
    send_queue_.set_leaves(std::move(leaves));
    read();
  }
  void enqueue(const SessionMessage& message) override {
    ASSERT_TRUE(send_queue_.add(message.seq, message.bytes));
    read();
  }
  void answer(const SessionMessage& message) override {
    ASSERT_TRUE(send_queue_.add_answer(message.bytes));
    read();
  }
  void replaced(const std::string&) override {}

  std::vector<v1::SessionResponse> told;

 private:
  void read() {
    for (MessageParts parts = send_queue_.take(); !parts.empty(); parts = send_queue_.take()) {
      std::string whole;
      for (const Bytes& part : parts) whole += *part;
      ASSERT_TRUE(told.emplace_back().ParseFromString(whole));
    }
  }
  SessionSendQueue send_queue_;
};

// A driven runtime over a disk in memory, with an instructor and a haptic client.
class BegunSession : public ::testing::Test {
 protected:
  void SetUp() override {
    open();
    ada = join(MemberKind::watcher, "Ada", Role::instructor);
    ben = join(MemberKind::surgeon, "Ben", Role::trainee);
  }
  void TearDown() override { kill(); }
  void open() {
    Result<PersistedRoom> kept = RoomStore::open("/rooms/femur", test_block(), options());
    ASSERT_TRUE(kept) << kept.error().message;
    store = std::move(kept->store);
    runtime = std::make_unique<RoomRuntime>(std::move(kept->room), RuntimeRates{.tick = 0ns, .mesh = 1s, .pieces = 0ns},
                                            nullptr, Detail::automatic, store.get());
  }
  RoomStore::Options options() {
    RoomStore::Options options;
    options.name = "femur";
    options.journal.disk = &disk;
    return options;
  }
  // Everything outside a transaction is lost.
  void kill() {
    runtime.reset();
    store.reset();
    subscribers.clear();
  }
  void tick(bool keep) { runtime->tick(now += 8ms, keep); }
  AuthorId join(MemberKind kind, const std::string& name, Role role) {
    AuthorId author;
    runtime->join(kind, name, kSecret, role, [&](const Result<AuthorId>& given) { author = given.value(); });
    tick(true);
    return author;
  }
  std::shared_ptr<ReceivedAtOnce> session() {
    auto subscriber = std::make_shared<ReceivedAtOnce>(ben);
    EXPECT_TRUE(runtime->open_session(subscriber, kSecret));
    return subscribers.emplace_back(std::move(subscriber));
  }
  // A mark, a cut and a decision about the haptic client: decided, but not yet durable.
  void change_all() {
    const auto ask = [&](std::function<Result<RoomEvent>(Room&)> change) {
      runtime->queue_event(std::move(change), [](const Result<RoomEvent>&) {});
    };
    ask([this](Room& room) { return room.mark(ada, "here"); });
    Cut cut = strokes(ben, 1, 3)[0];
    cut.lease_epoch = runtime->lease_epoch(ben);
    runtime->queue_cut(std::make_shared<ReceivedAtOnce>(ben), cut, {});
    ask([this](Room& room) { return room.supervise(ada, ben, {.stopped = true, .words = "wait"}); });
    tick(false);
  }

  test::MemoryDisk disk{1};
  std::unique_ptr<RoomStore> store;
  std::unique_ptr<RoomRuntime> runtime;
  std::vector<std::shared_ptr<ReceivedAtOnce>> subscribers;  // The runtime uses them until they leave.
  std::chrono::nanoseconds now{};
  AuthorId ada, ben;
};

std::size_t count(const ReceivedAtOnce& subscriber, v1::SessionResponse::MessageCase kind) {
  return static_cast<std::size_t>(std::ranges::count(subscriber.told, kind, &v1::SessionResponse::message_case));
}

// The newest sequence number of the room that it was sent.
std::uint64_t furthest(const ReceivedAtOnce& subscriber) {
  std::uint64_t seq = 0;
  for (const v1::SessionResponse& one : subscriber.told)
    seq = std::max({seq, one.scene().room_seq(), one.complete().room_seq(), one.committed().room_seq(),
                    one.supervised().room_seq()});
  return seq;
}

TEST_F(BegunSession, SendsNothingBeforeItIsDurable) {
  const RoomSeq kept = store->head().seq;
  change_all();
  ASSERT_EQ(runtime->room_seq().value, kept.value + 3) << "all of it is decided";
  ASSERT_EQ(store->head().seq, kept) << "none of it is durable";
  const auto hand = session();
  tick(false);
  tick(false);
  EXPECT_TRUE(hand->told.empty()) << hand->told.front().ShortDebugString();
  tick(true);
  ASSERT_EQ(store->head().seq.value, kept.value + 3);
  EXPECT_GT(count(*hand, v1::SessionResponse::kTool), 0u);
  EXPECT_GT(count(*hand, v1::SessionResponse::kLeaf), 0u);
  ASSERT_EQ(count(*hand, v1::SessionResponse::kScene), 1u);
  ASSERT_EQ(count(*hand, v1::SessionResponse::kSupervised), 1u);
  ASSERT_EQ(count(*hand, v1::SessionResponse::kComplete), 1u);
  EXPECT_EQ(furthest(*hand), kept.value + 3);
  EXPECT_TRUE(
      std::ranges::any_of(hand->told, [](const auto& one) { return one.supervised().supervision().stopped(); }));
}

// A client joins while the disk is slow, and the room is killed before the write is done. Nobody was sent what is lost.
TEST_F(BegunSession, OfARoomThatIsKilledSaysNoMoreThanWasLeft) {
  const auto before = session();
  tick(true);
  change_all();
  const auto again = session();  // The same haptic client over another connection.
  tick(false);
  const std::uint64_t heard = std::max(furthest(*before), furthest(*again));
  const RoomSeq decided = runtime->room_seq();
  kill();
  open();
  EXPECT_LT(runtime->room_seq(), decided) << "something was lost";
  EXPECT_LE(heard, runtime->room_seq().value);
  EXPECT_EQ(count(*before, v1::SessionResponse::kComplete), 1u);
  const auto after = session();
  tick(true);
  EXPECT_EQ(count(*after, v1::SessionResponse::kSupervised), 0u) << "a decision that was never sent has no effect";
}

}  // namespace
}  // namespace osteon
