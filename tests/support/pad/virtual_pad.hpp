// A game pad that exists in SDL only. It is plugged in and out, its controls are held, and its motors are heard.
#pragma once
#include <cstdint>
#include <vector>

#include "viewer_client/pad/game_pad_mapping.hpp"

namespace osteon::test {

// [the thread of the GamePad]
class VirtualPad {
 public:
  VirtualPad();  // not plugged in yet. SDL sees no pad of this machine from then on.
  ~VirtualPad();

  [[nodiscard]] bool plug_in();
  void unplug();
  // Holds the controls so from SDL's next look on. The right shoulder button stands for both.
  void hold(const GamePadState& state);
  struct Motors {
    std::uint16_t low = 0, high = 0;  // as SDL asks for them
  };
  // What SDL asked for, oldest first.
  [[nodiscard]] const std::vector<Motors>& heard() const { return heard_; }
  [[nodiscard]] bool quiet() const { return heard_.empty() || (heard_.back().low == 0 && heard_.back().high == 0); }

 private:
  std::vector<Motors> heard_;
  void* joystick_ = nullptr;
  int instance_ = -1;
};

}  // namespace osteon::test
