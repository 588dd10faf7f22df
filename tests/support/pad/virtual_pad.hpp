// A game pad that exists in SDL only. It is plugged in and out, its controls are held, and its motors are heard.
#pragma once
#include <cstdint>
#include <mutex>
#include <vector>

#include "viewer_client/pad/game_pad_mapping.hpp"

namespace osteon::test {

// [one thread; the pad may be read on another]
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
  [[nodiscard]] std::vector<Motors> heard() const;
  [[nodiscard]] bool quiet() const;
  // In between, whoever asks SDL for a pad waits, as for a device that does not answer. Both on one thread.
  static void lock_sdl();
  static void unlock_sdl();

 private:
  mutable std::mutex mutex_;   // guards heard_
  std::vector<Motors> heard_;  // by the thread that asks SDL
  void* joystick_ = nullptr;
  int instance_ = -1;
};

}  // namespace osteon::test
