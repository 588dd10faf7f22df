// SpaceMouse by hidapi: the cap, for whoever moves a tool or a camera with it.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/input/hid_port.hpp"
#include "common/input/space_mouse_report.hpp"

namespace osteon {

[[nodiscard]] std::vector<HidFound> list_space_mice();

// One that is opened and closed by its owner.
class SpaceMousePort {
 public:
  struct Calls {
    std::function<void(const SpaceMouseState&)>
        moved;                   // [its reading thread] after each report, and every millisecond without
    std::function<void()> lost;  // [its reading thread]
  };
  // `light`: its LED shines while it is open. Errors: not_found, unavailable.
  [[nodiscard]] Result<HidFound> open(bool light, Calls calls);
  void close() noexcept { reader_.stop(); }
  // Error: it was unplugged.
  [[nodiscard]] Result<void> health() const { return reader_.health(); }
  [[nodiscard]] int battery_percent() const noexcept { return battery_; }  // −1: it has said nothing

 private:
  SpaceMouseState state_;  // reading thread, while it runs
  std::chrono::steady_clock::time_point moved_;
  std::atomic<int> battery_{-1};
  HidReader reader_;  // last: its thread ends before what it uses
};

// One that is looked for, read and looked for again by a thread of its own.
class SpaceMouseWatch {
 public:
  // `say` is told on that thread, in a sentence, when one has come and when it has gone.
  explicit SpaceMouseWatch(std::function<void(const std::string&)> say);
  ~SpaceMouseWatch();
  // [one reader] At rest while there is none.
  [[nodiscard]] SpaceMouseState cap() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace osteon
