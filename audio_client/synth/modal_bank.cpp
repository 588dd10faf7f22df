#include "audio_client/synth/modal_bank.hpp"

#include <cmath>
#include <numbers>

namespace osteon::audio {
namespace {

constexpr float kInaudibleMode = 1e-6F;

}  // namespace

void ModalBank::strike(std::size_t mode, double hz, double decay_s, double amplitude, double rate_hz) noexcept {
  if (mode >= modes_.size() || hz >= 0.45 * rate_hz) return;
  State& m = modes_[mode];
  const double shrink = std::exp(-1.0 / (decay_s * rate_hz)), turn = 2.0 * std::numbers::pi * hz / rate_hz;
  m.cos = static_cast<float>(shrink * std::cos(turn));
  m.sin = static_cast<float>(shrink * std::sin(turn));
  m.re += static_cast<float>(amplitude);  // the imaginary part sounds
  ringing_ = true;
}

void ModalBank::add_to(Block& block) noexcept {
  if (!ringing_) return;
  ringing_ = false;
  for (State& m : modes_) {
    if (std::abs(m.re) + std::abs(m.im) < kInaudibleMode) {
      m.re = m.im = 0;
      continue;
    }
    ringing_ = true;
    float re = m.re, im = m.im;
    for (float& x : block) {
      x += im;
      const float next = re * m.cos - im * m.sin;
      im = re * m.sin + im * m.cos;
      re = next;
    }
    m.re = re;
    m.im = im;
  }
}

}  // namespace osteon::audio
