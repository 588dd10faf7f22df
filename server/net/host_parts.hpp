// What a RoomHost is made of: its streams, what waits for a tick, and what is shown of the tools.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "server/net/room_host.hpp"

namespace osteon {

// The open streams of one kind.
template <class Sink>
class Audience {
 public:
  void add(Sink& sink) { sinks_.push_back(&sink); }
  void remove(Sink& sink) { std::erase(sinks_, &sink); }
  template <class Call>
  void each(Call call) const {
    for (Sink* sink : sinks_) call(*sink);
  }
  [[nodiscard]] std::size_t size() const { return sinks_.size(); }

 private:
  std::vector<Sink*> sinks_;
};

struct QueuedCut {
  std::shared_ptr<SessionSink> sink;  // owned by its stream and by its queued cuts
  Cut cut;
  RoomHost::Clock::time_point arrived;
};
struct QueuedEvent {
  std::function<Result<RoomEvent>(Room&)> change;
  std::function<void(const Result<RoomEvent>&)> answer;
  RoomHost::Clock::time_point arrived;
};
using Queued = std::variant<QueuedCut, QueuedEvent>;

// A tool's newest state; one whose session is over is shown idle for a while, so that every reader sees it stop.
struct ShownState {
  CuttingState state;
  bool over = false;
  std::uint64_t ticks_over = 0;
};
inline constexpr std::uint64_t kShowIdleTicks = 1200;

}  // namespace osteon
