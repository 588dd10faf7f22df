#include "haptic_client/app/room_queue.hpp"

#include <utility>

namespace osteon::haptic {

bool RoomQueue::push(RoomMessage&& message) {
  MutexLock lock(mutex_);
  while (waiting_.messages.size() >= kMost && !closed_) taken_.wait(lock);
  if (closed_) return false;
  waiting_.messages.push_back(std::move(message));
  filled_.notify_one();
  return true;
}

void RoomQueue::push_tool(const std::string& name) {
  const MutexLock lock(mutex_);
  waiting_.tools.push_back(name);
  filled_.notify_one();
}

void RoomQueue::take(Batch& batch, std::chrono::milliseconds patience) {
  MutexLock lock(mutex_);
  filled_.wait_for(lock, patience,
                   [this]() OSTEON_REQUIRES(mutex_) { return !waiting_.messages.empty() || !waiting_.tools.empty(); });
  batch.messages.swap(waiting_.messages);
  batch.tools.swap(waiting_.tools);
  taken_.notify_all();
}

void RoomQueue::close() {
  const MutexLock lock(mutex_);
  closed_ = true;
  taken_.notify_all();
}

}  // namespace osteon::haptic
