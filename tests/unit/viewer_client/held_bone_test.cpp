// The thread that holds a bone: what it does when streams end, and how it ends itself.
#include "viewer_client/net/held_bone.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <utility>

#include "tests/unit/viewer_client/followed_room.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::FieldMessages;
using test::FollowedRoom;

constexpr auto kPatience = 30s;
constexpr HeldBoneOptions kQuick{.pause = 1ms, .longest_pause = 5ms};

// Streams that a test prepares: messages, then how each ends. The last one stays open until it is cancelled.
class PreparedSource final : public FieldSource {
 public:
  struct Stream {
    FieldMessages messages;
    std::optional<End> end{};
  };
  struct Calls {
    std::atomic<int> imported{0}, streams{0};
    std::atomic<bool> cancelled{false};
  };

  PreparedSource(std::deque<Result<Case>> cases, std::deque<Stream> streams, Calls& calls)
      : cases_(std::move(cases)), streams_(std::move(streams)), calls_(calls) {}

  Result<Case> imported() override {
    ++calls_.imported;
    Result<Case> one = cases_.front();
    if (cases_.size() > 1) cases_.pop_front();
    return one;
  }
  End read(const std::function<bool(const v1::WatchFieldResponse&)>& take) override {
    ++calls_.streams;
    const Stream stream = streams_.front();
    if (streams_.size() > 1) streams_.pop_front();
    for (const v1::WatchFieldResponse& message : stream.messages)
      if (!take(message)) return {{ErrorCode::cancelled, "not taken"}};
    if (stream.end) return *stream.end;
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return calls_.cancelled.load(); });
    return {{ErrorCode::cancelled, "cancelled"}};
  }
  void cancel() override {
    const std::lock_guard lock(mutex_);
    calls_.cancelled = true;
    wake_.notify_all();
  }

 private:
  std::deque<Result<Case>> cases_;
  std::deque<Stream> streams_;
  Calls& calls_;
  std::mutex mutex_;
  std::condition_variable wake_;
};

class Held : public testing::Test {
 protected:
  std::unique_ptr<HeldBone> hold(std::deque<PreparedSource::Stream> streams, const HeldBoneOptions& options = kQuick) {
    return HeldBone::start(
        std::make_unique<PreparedSource>(std::deque<Result<Case>>{bone_}, std::move(streams), calls_), options);
  }
  // All that a stream that begins now is sent.
  FieldMessages beginning() { return room_.open()->read(); }
  static bool reaches(const HeldBone& bone, HeldBoneState state, RoomSeq seq = {}) {
    return bone.wait([&](const HeldBoneStatus& now) { return now.state == state && now.room_seq >= seq; }, kPatience);
  }
  void expect_bone(const HeldBone& held, const BoneStatus& expected) {
    Digest hash;
    ASSERT_TRUE(held.read([&](const Replica& bone) { hash = bone.hash(); }));
    EXPECT_EQ(hash, expected.field_hash);
    EXPECT_EQ(held.status().room_seq, expected.room_seq);
  }

  const Case bone_ = test::test_block();
  FollowedRoom room_{bone_};
  PreparedSource::Calls calls_;
};

TEST_F(Held, ComesBackAfterALostConnectionWithTheRoomsBone) {
  room_.cut(3);
  PreparedSource::Stream first{beginning(), FieldSource::End{{ErrorCode::unavailable, "cable"}}};
  const BoneStatus before = room_.status();
  room_.cut(3);
  const PreparedSource::Stream second{beginning()};
  const auto held = hold({first, second});
  ASSERT_TRUE(reaches(*held, HeldBoneState::follows, room_.status().room_seq));
  expect_bone(*held, room_.status());
  EXPECT_EQ(held->status().asked_again, 1u);
  EXPECT_FALSE(held->status().why) << "it follows again";
  EXPECT_NE(before.field_hash, room_.status().field_hash);
  EXPECT_TRUE(held->take_changes().all);
}

TEST_F(Held, AsksAgainWhereAMessageIsMissing) {
  const auto tap = room_.open();
  FieldMessages messages = tap->read();
  room_.cut(3);
  for (v1::WatchFieldResponse& message : tap->read()) messages.push_back(std::move(message));
  messages.erase(messages.end() - 2);
  const auto held = hold({{messages}, {beginning()}});
  ASSERT_TRUE(reaches(*held, HeldBoneState::follows, room_.status().room_seq));
  expect_bone(*held, room_.status());
  EXPECT_EQ(calls_.streams, 2);
}

TEST_F(Held, KeepsTheBoneWhileItIsInterrupted) {
  room_.cut(3);
  const PreparedSource::Stream lost{beginning(), FieldSource::End{{ErrorCode::unavailable, "cable"}}};
  const PreparedSource::Stream dead{{}, FieldSource::End{{ErrorCode::unavailable, "no server"}}};
  const auto held = hold({lost, dead});
  ASSERT_TRUE(held->wait([&](const HeldBoneStatus& now) { return now.asked_again >= 3; }, kPatience));
  ASSERT_TRUE(reaches(*held, HeldBoneState::interrupted));
  expect_bone(*held, room_.status());
  EXPECT_EQ(held->status().why->message, "no server");
}

TEST_F(Held, GivesTheBoneUpWhenItIsRefusedForGood) {
  const PreparedSource::Stream lost{beginning(), FieldSource::End{{ErrorCode::unavailable, "cable"}}};
  const PreparedSource::Stream refused{{}, FieldSource::End{{ErrorCode::denied, "your role may not"}, true}};
  const auto held = hold({lost, refused});
  ASSERT_TRUE(reaches(*held, HeldBoneState::failed));
  EXPECT_EQ(held->status().why->code, ErrorCode::denied);
  EXPECT_EQ(held->status().bytes, 0u);
  EXPECT_FALSE(held->read([](const Replica&) { ADD_FAILURE() << "there is no bone"; }));
  EXPECT_EQ(calls_.streams, 2) << "and is not asked for again";
}

TEST_F(Held, GivesUpABoneThatNeedsTooMuch) {
  room_.cut(6);
  HeldBoneOptions small = kQuick;
  small.most_bytes = 8 * 1024;
  const auto held = hold({{beginning()}}, small);
  ASSERT_TRUE(reaches(*held, HeldBoneState::failed));
  EXPECT_EQ(held->status().why->code, ErrorCode::exhausted);
  EXPECT_EQ(calls_.streams, 1);
}

TEST_F(Held, FetchesTheCaseUntilItHasIt) {
  const Error away{ErrorCode::unavailable, "no server"};
  std::deque<Result<Case>> cases{tl::unexpected(away), tl::unexpected(away), bone_};
  std::deque<PreparedSource::Stream> streams{{beginning()}};
  auto source = std::make_unique<PreparedSource>(std::move(cases), std::move(streams), calls_);
  const auto held = HeldBone::start(std::move(source), kQuick);
  ASSERT_TRUE(reaches(*held, HeldBoneState::follows));
  EXPECT_EQ(calls_.imported, 3);
  expect_bone(*held, room_.status());

  PreparedSource::Calls others;
  const Error full{ErrorCode::internal, "the disk is full"};
  std::deque<Result<Case>> none{tl::unexpected(full)};
  std::deque<PreparedSource::Stream> nothing{{}};
  auto poor = std::make_unique<PreparedSource>(std::move(none), std::move(nothing), others);
  const auto failed = HeldBone::start(std::move(poor), kQuick);
  ASSERT_TRUE(reaches(*failed, HeldBoneState::failed));
  EXPECT_EQ(failed->status().why->message, "the disk is full");
  EXPECT_EQ(others.streams, 0);
}

TEST_F(Held, EndsWhileItReads) {
  auto held = hold({{beginning()}});
  ASSERT_TRUE(reaches(*held, HeldBoneState::follows));
  held->end();
  expect_bone(*held, room_.status());
  held.reset();
  EXPECT_TRUE(calls_.cancelled);
}

// A picture of a large bone, or an undo, takes long. A window asks for the status, or closes, meanwhile.
TEST_F(Held, AnswersAndEndsWhileTheBoneIsInUse) {
  const auto held = hold({{beginning()}});
  ASSERT_TRUE(reaches(*held, HeldBoneState::follows));
  std::future<HeldBoneState> told;
  std::future<void> ended;
  ASSERT_TRUE(held->read([&](const Replica&) {
    told = std::async(std::launch::async, [&] { return held->status().state; });
    EXPECT_EQ(told.wait_for(10s), std::future_status::ready);
    ended = std::async(std::launch::async, [&] { held->end(); });
    EXPECT_EQ(ended.wait_for(10s), std::future_status::ready);
  }));
  EXPECT_EQ(told.get(), HeldBoneState::follows);
  ended.get();
}

}  // namespace
}  // namespace osteon
