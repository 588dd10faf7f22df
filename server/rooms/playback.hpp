// Repeats entries of one room in another: says which entries are due, and where their tools are shown.
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

// Entries of another room that are repeated in this one, which decides nothing itself.
struct Playback {
  std::function<std::optional<LogEntry>()> next;  // [tick] nothing: there are no more entries
  double speed = 1.0;                             // times the original speed; 0: nothing happens
};

// One thread: the tick thread, or that of a demonstration. `now`: time since any start; never decreases.
class Player {
 public:
  using Time = std::chrono::nanoseconds;
  // a tool is shown at work for this long after its newest cut
  static constexpr std::chrono::milliseconds kSeenAfterCut{250};
  // `from`: the time in the shown room at which playback begins, with the first call of take().
  Player(Playback playback, Time from) : playback_(std::move(playback)), from_(from) {}

  // The next entry, once its time has come.
  [[nodiscard]] std::optional<LogEntry> take(Time now);
  // No entry comes after this, not even one whose time is awaited.
  void stop() {
    playback_.next = nullptr;
    upcoming_.reset();
  }

  // The tool state that follows from a recorded cut; nothing for an unknown tool. The state's number rises with every
  // state, also with idle ones, since readers take only newer states.
  [[nodiscard]] std::optional<CuttingState> see(const Cut& cut, const ToolBox& tools, Time now);
  // Idle states, once each, of tools that have not cut for a while. What they did between two cuts is not recorded.
  [[nodiscard]] std::vector<CuttingState> at_rest(Time now);
  // The same at once for all tools that are shown at work: they were stopped.
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
