// Reads the cap of a SpaceMouse by hidapi, to move a tool or a camera.
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

// A SpaceMouse that its owner opens and closes.
class SpaceMousePort {
 public:
  struct Calls {
    std::function<void(const SpaceMouseState&)>
        moved;                   // [its reading thread] after each report, and every millisecond without one
    std::function<void()> lost;  // [its reading thread]
  };
  // `light`: its LED is on while it is open. Errors: not_found, unavailable.
  [[nodiscard]] Result<HidFound> open(bool light, Calls calls);
  void close() noexcept { reader_.stop(); }
  // Error: it was unplugged.
  [[nodiscard]] Result<void> health() const { return reader_.health(); }
  [[nodiscard]] int battery_percent() const noexcept { return battery_; }  // −1: not reported yet

 private:
  SpaceMouseState state_;  // reading thread, while it runs
  std::chrono::steady_clock::time_point moved_;
  std::atomic<int> battery_{-1};
  HidReader reader_;  // last: its thread ends before what it uses is destroyed
};

// Looks for a SpaceMouse and reads it on a thread of its own. Looks again when it was removed.
class SpaceMouseWatch {
 public:
  // `say` is called on that thread, with a sentence, when a device is connected or removed.
  explicit SpaceMouseWatch(std::function<void(const std::string&)> say);
  ~SpaceMouseWatch();
  // [one reader] At rest while there is no device.
  [[nodiscard]] SpaceMouseState cap() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace osteon
