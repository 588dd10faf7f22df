// A room in this process, and connections to it that keep the messages of the field's stream. A test hands these to a
// viewer as a good or a bad network would.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "osteon/v1/field.pb.h"
#include "server/rooms/room_runtime.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/fake_session.hpp"

namespace osteon::test {

using FieldMessages = std::vector<v1::WatchFieldResponse>;

// The room's end of a stream. Any thread.
class FieldTap final : public FieldSubscriber {
 public:
  explicit FieldTap(AuthorId author) : author_(author) {}
  AuthorId author() const override { return author_; }
  void begin(SessionStart start) override {
    const std::lock_guard lock(mutex_);
    begun_ = true;
    MessageParts before;
    for (const SessionMessage& message : start.before) before.push_back(message.bytes);
    queue_.begin(start.contained, std::move(before), std::move(start.complete), start.leaf_bytes);
  }
  void set_leaves(std::vector<FieldLeaf> leaves) override {
    const std::lock_guard lock(mutex_);
    given_ = true;
    queue_.set_leaves(std::move(leaves));
  }
  void enqueue(const SessionMessage& message) override {
    const std::lock_guard lock(mutex_);
    EXPECT_TRUE(queue_.add(message.seq, field_entry(message, true)));
  }
  void end(const std::string& why) override {
    const std::lock_guard lock(mutex_);
    ended_ = why;
  }
  void replaced(const std::string& why) override {
    const std::lock_guard lock(mutex_);
    ended_ = why;
    may_return_ = true;
  }
  std::size_t waiting() const override {
    const std::lock_guard lock(mutex_);
    return queue_.waiting();
  }
  std::size_t leaf_bytes() const override {
    const std::lock_guard lock(mutex_);
    return queue_.leaf_bytes();
  }

  // What was sent since the last call.
  FieldMessages read() {
    const std::lock_guard lock(mutex_);
    FieldMessages messages;
    for (MessageParts parts = queue_.take(); !parts.empty(); parts = queue_.take()) {
      std::string whole;
      for (const Bytes& part : parts) whole += *part;
      EXPECT_TRUE(messages.emplace_back().ParseFromString(whole));
    }
    return messages;
  }
  std::string ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }
  bool may_return() const {
    const std::lock_guard lock(mutex_);
    return may_return_;
  }
  bool begun() const {
    const std::lock_guard lock(mutex_);
    return begun_;
  }
  bool given_leaves() const {
    const std::lock_guard lock(mutex_);
    return given_;
  }

 private:
  const AuthorId author_;
  mutable std::mutex mutex_;
  SessionSendQueue queue_;
  std::string ended_;
  bool may_return_ = false, begun_ = false, given_ = false;
};

// Driven by the test: nothing happens between its ticks. With a store, a test says when it writes.
class FollowedRoom {
 public:
  explicit FollowedRoom(const Case& bone) : FollowedRoom(Room(bone), nullptr) {}
  FollowedRoom(Room room, RoomStore* store, std::size_t most_leaf_bytes = RuntimeRates{}.most_leaf_bytes)
      : runtime_(std::move(room), driven(most_leaf_bytes), nullptr, Detail::automatic, store) {
    hand_ = join(MemberKind::surgeon, "Ben", Role::trainee);
    viewer_ = join(MemberKind::watcher, "Ada", Role::instructor);
    sender_ = std::make_shared<FakeSession>(hand_);
  }

  RoomRuntime& runtime() { return runtime_; }
  AuthorId join(MemberKind kind, const std::string& name, Role role) {
    AuthorId author;
    runtime_.join(kind, name, {}, role, [&](const Result<AuthorId>& given) { author = given.value(); });
    tick();
    return author;
  }
  AuthorId hand() const { return hand_; }
  AuthorId viewer() const { return viewer_; }
  BoneStatus status() { return runtime_.bone_status(); }

  std::shared_ptr<FieldTap> open() { return open(viewer_); }
  std::shared_ptr<FieldTap> open(AuthorId viewer) {
    taps_.push_back(std::make_shared<FieldTap>(viewer));
    EXPECT_TRUE(runtime_.watch_field(taps_.back()));
    return taps_.back();
  }
  // Strokes at random places. They count as the hand's next cuts.
  void cut(int count) {
    for (int i = 0; i < count; ++i) queue_cut(), tick();
  }
  void queue_cut() {
    Cut cut = strokes(hand_, ++cuts_, 5).back();
    cut.lease_epoch = runtime_.lease_epoch(hand_);
    runtime_.queue_cut(sender_, cut, {});
  }
  void happen(std::function<Result<RoomEvent>(Room&)> change) {
    bool happened = false;
    runtime_.queue_event(std::move(change), [&](const Result<RoomEvent>& event) {
      happened = event.has_value();
      EXPECT_TRUE(event) << event.error().message;
    });
    tick();
    EXPECT_TRUE(happened);
  }
  void tick(bool keep = true) { runtime_.tick(now_ += std::chrono::milliseconds(8), keep); }

 private:
  static RuntimeRates driven(std::size_t most_leaf_bytes) {
    RuntimeRates rates;
    rates.most_leaf_bytes = most_leaf_bytes;
    rates.tick = rates.pieces = std::chrono::nanoseconds(0);
    rates.mesh = std::chrono::seconds(1);
    return rates;
  }

  std::vector<std::shared_ptr<FieldTap>> taps_;  // the runtime uses them until its end
  std::shared_ptr<FakeSession> sender_;
  RoomRuntime runtime_;
  AuthorId hand_, viewer_;
  std::chrono::nanoseconds now_{};
  int cuts_ = 0;
};

}  // namespace osteon::test
