// Reads a game pad on a thread of its own, because SDL opens devices, and a device may take its time.
#pragma once
#include <chrono>
#include <memory>
#include <string>

#include "viewer_client/pad/game_pad.hpp"

namespace osteon {

// What happened to the pad since the last reading, and its newest state.
struct GamePadReading {
  bool lost = false, opened = false;  // in this order, if both
  bool is_open = false;
  std::string name;    // of the pad that was open last
  GamePadState state;  // at rest while no pad is open
  // Since the state was read. It grows while SDL waits for a device. Zero before the first reading.
  std::chrono::steady_clock::duration age{};
};

// SDL starts, is used and ends on that thread, as libudev asks. [any thread]
class GamePadReader {
 public:
  GamePadReader();   // returns before SDL has started
  ~GamePadReader();  // waits for SDL's start and end; the motors stop
  GamePadReader(const GamePadReader&) = delete;
  GamePadReader& operator=(const GamePadReader&) = delete;

  // Never waits for SDL.
  [[nodiscard]] GamePadReading take();
  // Sets the strength of the motors of the open pad, as GamePad::rumble() does, within one period.
  void rumble(const GamePadRumble& strength);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace osteon
