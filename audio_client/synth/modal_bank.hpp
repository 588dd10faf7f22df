// Damped modes that are struck: a rotation in the complex plane for each, which shrinks.
#pragma once
#include <array>
#include <cstddef>

#include "audio_client/presets/tool_model.hpp"
#include "audio_client/synth/limiter.hpp"

namespace osteon::audio {

class ModalBank {
 public:
  // [audio] Adds a blow. Its sound begins at zero and rises like a sine, so there is no click. What still rings goes
  // on, at the new frequency.
  void strike(std::size_t mode, double hz, double decay_s, double amplitude, double rate_hz) noexcept;
  void add_to(Block& block) noexcept;  // [audio]
  [[nodiscard]] bool ringing() const noexcept { return ringing_; }

 private:
  struct State {
    float re = 0, im = 0, cos = 1, sin = 0;
  };
  std::array<State, kMostModes> modes_{};
  bool ringing_ = false;
};

}  // namespace osteon::audio
