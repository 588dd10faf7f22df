// A game pad, read by the game controllers of SDL 2. Which control is which is known to SDL's own list of pads.
#pragma once
#include <memory>
#include <string>

#include "viewer_client/pad/pad_control.hpp"

namespace osteon {

// The first pad that is there. [one thread: that of the constructor]
class GamePad {
 public:
  enum class Change { none, opened, lost };

  GamePad();   // starts SDL's part for game pads: no window, no sound, no handlers of signals
  ~GamePad();  // the motors stop

  // Looks for a pad while none is open, and reads the open one.
  Change poll();
  [[nodiscard]] bool is_open() const;
  // For people. Of the pad that was open last.
  [[nodiscard]] const std::string& name() const;
  // As of the last poll(). At rest while no pad is open.
  [[nodiscard]] const PadState& state() const;
  // The motors run so until the next call or poll() after kRumble_ms. A pad without motors ignores it.
  void rumble(const PadRumble& strength);
  static constexpr unsigned kRumble_ms = 150;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
