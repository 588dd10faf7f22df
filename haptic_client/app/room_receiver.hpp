// Receives what the room sends, on the session's threads. What must act at once goes straight to the haptic loop.
// Everything that has an order goes to the replica's thread.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <set>
#include <span>
#include <string>

#include "haptic_client/app/client_end.hpp"
#include "haptic_client/app/room_queue.hpp"
#include "haptic_client/app/worker_exchange.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic {

class RoomReceiver {
 public:
  // `tools`: the loop's. All arguments must outlive this.
  RoomReceiver(std::span<const ToolModel> tools, RoomQueue& queue, WorkerExchange& exchange, ClientEnd& end)
      : tools_(tools), queue_(queue), exchange_(exchange), end_(end) {}

  // For RoomSession::open(). This must outlive the session's last call.
  [[nodiscard]] RoomCallbacks callbacks();
  // When the last message was taken; the clock's epoch: none yet. Any thread.
  [[nodiscard]] std::chrono::steady_clock::time_point last_received() const noexcept {
    return last_received_.load(std::memory_order_relaxed);
  }

 private:
  // Waits while too many messages are there.
  void receive(RoomMessage&& message);
  void receive_partner(const CuttingState& state);

  std::span<const ToolModel> tools_;
  RoomQueue& queue_;
  WorkerExchange& exchange_;
  ClientEnd& end_;
  std::atomic<std::chrono::steady_clock::time_point> last_received_{};
  // Number of the present connection. Mount poses come on a thread of their own.
  std::atomic<std::uint64_t> line_{1};
  Partners partners_;
  std::set<std::string> named_tools_;
};

}  // namespace osteon::haptic
