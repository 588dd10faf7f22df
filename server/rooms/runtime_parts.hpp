// What is queued for the tick of a RoomRuntime.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "server/rooms/room_runtime.hpp"

namespace osteon {

struct QueuedCut {
  std::shared_ptr<SessionSubscriber> subscriber;  // shared by its stream and its queued cuts
  Cut cut;
  RoomRuntime::Clock::time_point arrived;
};
struct QueuedEvent {
  std::function<Result<RoomEvent>(Room&)> change;
  std::function<void(const Result<RoomEvent>&)> answer;
  RoomRuntime::Clock::time_point arrived;
};
using Queued = std::variant<QueuedCut, QueuedEvent>;

}  // namespace osteon
