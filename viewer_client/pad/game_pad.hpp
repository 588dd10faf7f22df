// A game pad, read through SDL 2. SDL's own list of pads says which control is which.
#pragma once
#include <memory>
#include <string>

#include "viewer_client/pad/game_pad_mapping.hpp"

namespace osteon {

// The first pad that SDL lists. [one thread: that of the constructor]
class GamePad {
 public:
  enum class Change { none, opened, lost };

  GamePad();   // starts SDL's part for game pads: no window, no sound, no handlers of signals
  ~GamePad();  // the motors stop

  // Looks for a pad while none is open, and reads the open one.
  Change poll();
  [[nodiscard]] bool is_open() const;
  // Of the pad that was open last, for texts of the window.
  [[nodiscard]] const std::string& name() const;
  // As of the last poll(). At rest while no pad is open.
  [[nodiscard]] const GamePadState& state() const;
  // Sets the strength of the motors. It lasts until the next call, or ends at the first poll() after kRumble_ms. A pad
  // without motors ignores it.
  void rumble(const GamePadRumble& strength);
  static constexpr unsigned kRumble_ms = 150;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
