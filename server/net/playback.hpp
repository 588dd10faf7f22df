// What happened in one room happening again in another: which entries are due, and where their tools are seen.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/mechanics/cutting_state.hpp"
#include "common/tools/tool_box.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

// Rows of another room that happen again in this one, which decides nothing itself.
struct Playback {
  std::function<std::optional<LogEntry>()> next;  // [tick] nothing: the last one was given
  double speed = 1.0;                            // times as fast as it happened; 0: nothing happens
};

// One thread: the tick's, or that of a demonstration. `now`: since any start, never falls.
class Player {
 public:
  using Time = std::chrono::nanoseconds;
  static constexpr std::chrono::milliseconds kSeenAfterCut{250};  // so long a tool is seen at work after its newest cut
  // `from`: the time of the room that is shown at which it begins, with the first call of take().
  Player(Playback playback, Time from) : playback_(std::move(playback)), from_(from) {}

  // The next entry, once its time has come.
  [[nodiscard]] std::optional<LogEntry> take(Time now);
  // No entry comes any more, neither one that is being waited for.
  void stop() {
    playback_.next = nullptr;
    upcoming_.reset();
  }

  // A recorded cut says where its tool was: nothing of a tool that nobody knows. Its number rises with every state,
  // also with those at rest, as readers take only newer ones.
  [[nodiscard]] std::optional<CuttingState> see(const Cut& cut, const ToolBox& tools, Time now);
  // Idle, once: tools that have not cut for a while. What they did between two cuts is not recorded.
  [[nodiscard]] std::vector<CuttingState> at_rest(Time now);
  // The same at once, of all that are seen at work: they were stopped.
  [[nodiscard]] std::vector<CuttingState> at_rest() { return at_rest(Time::max()); }

 private:
  struct Seen {
    CuttingState state;
    Time last_cut;
  };
  Playback playback_;
  const Time from_;
  std::optional<Time> began_;
  std::optional<LogEntry> upcoming_;
  std::map<AuthorId, Seen> seen_;
  std::uint64_t states_ = 0;
};

}  // namespace osteon
