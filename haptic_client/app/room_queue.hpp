// The room's messages on their way to the replica's thread. Where too many wait, the reader of the network waits too.
#pragma once
#include <chrono>
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "common/core/mutex.hpp"
#include "haptic_client/net/room_messages.hpp"

namespace osteon::haptic {

class RoomQueue {
 public:
  static constexpr std::size_t kMost = 4096;  // messages that may wait

  struct Batch {
    std::deque<RoomMessage> messages;  // in the order received
    std::vector<std::string> tools;    // names of partners' tools that are new here
  };

  // [session] Waits while kMost messages are there. False, and the message is dropped: the queue is closed.
  bool push(RoomMessage&& message);
  // [session] Never waits.
  void push_tool(const std::string& name);
  // [replica] Takes everything, or what came within `patience`. `batch` must be empty.
  void take(Batch& batch, std::chrono::milliseconds patience);
  // [replica] From now on nobody waits, and messages are dropped.
  void close();

 private:
  Mutex mutex_{LockRank::leaf};
  CondVar filled_, taken_;
  Batch waiting_ OSTEON_GUARDED_BY(mutex_);
  bool closed_ OSTEON_GUARDED_BY(mutex_) = false;
};

}  // namespace osteon::haptic
