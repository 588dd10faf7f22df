// What a room is told of the own shots. Fifteen pictures a second would be too many for it, so it gets the newest
// picture of each press, a few times a second, with the counts of all of them.
#pragma once
#include <chrono>
#include <cstddef>
#include <deque>
#include <optional>

#include "common/tools/c_arm_shot.hpp"

namespace osteon {

// Not synchronised: one thread.
class SharedShots {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kApart{250};  // [A] between two messages
  static constexpr std::size_t kMostWaiting = 16;          // presses; older ones are left out, and count all the same

  struct Message {
    ShotRun run;
    ShotTotals session;
  };

  // A new room: nothing waits any more.
  void begin() { *this = {}; }
  // A shot was counted. `first`: of its press. `session`: with it.
  void add(const CArmShot& shot, bool first, const ShotTotals& session);
  // The message to send now, if there is one. Then nothing until answered(). Each press in turn, oldest first.
  [[nodiscard]] std::optional<Message> due(Clock::time_point now);
  void answered() { under_way_ = false; }
  // The room was not there for it. It waits again, unless a newer state of its press does.
  void put_back(const ShotRun& run);
  [[nodiscard]] bool idle() const { return waiting_.empty(); }  // nothing waits

 private:
  std::optional<ShotRun> press_;  // the newest
  std::deque<ShotRun> waiting_;   // of each press at most one
  ShotTotals session_;
  Clock::time_point next_{};
  bool under_way_ = false;
};

}  // namespace osteon
