#include "haptic_client/app/room_queue.hpp"

#include <utility>

namespace osteon::haptic {

bool RoomQueue::push(RoomMessage&& message) {
  std::unique_lock lock(mutex_);
  taken_.wait(lock, [this] { return waiting_.messages.size() < kMost || closed_; });
  if (closed_) return false;
  waiting_.messages.push_back(std::move(message));
  filled_.notify_one();
  return true;
}

void RoomQueue::push_tool(const std::string& name) {
  const std::lock_guard lock(mutex_);
  waiting_.tools.push_back(name);
  filled_.notify_one();
}

void RoomQueue::take(Batch& batch, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  filled_.wait_for(lock, patience, [this] { return !waiting_.messages.empty() || !waiting_.tools.empty(); });
  batch.messages.swap(waiting_.messages);
  batch.tools.swap(waiting_.tools);
  taken_.notify_all();
}

void RoomQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  taken_.notify_all();
}

}  // namespace osteon::haptic
