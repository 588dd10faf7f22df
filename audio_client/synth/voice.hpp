// The sound of one tool: spindle-locked partials, chip and air noise, and the knock when a layer gives way.
#pragma once
#include <array>
#include <cstdint>

#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/noise.hpp"
#include "audio_client/synth/sound_scene.hpp"

namespace osteon::audio {

// Constants of the sound that do not belong to the hand piece.
struct VoiceParams {
  double run_up_s = 0.25;      // from rest to the commanded speed
  double run_down_s = 0.45;    // and back
  double smoothing_s = 0.005;  // of speed and load: hides the steps between states
  double noise = 1.0;          // gain of all noise, 0 leaves the partials
  double flutter = 0.12;  // slow unsteadiness of each partial's level, relative (8.5.4: sources are not stationary)
};

class Voice {
 public:
  void start(const Handpiece& handpiece, const VoiceParams& params, double rate_hz, const ToolSound& tool,
             std::uint64_t seed) noexcept;
  void aim(const ToolSound& tool) noexcept;  // its target sound from now on
  void release() noexcept { target_.rpm = target_.load = target_.hardness = target_.chips = 0; }  // runs down
  void add_to(Block& block) noexcept;  // the next kBlockFrames

  [[nodiscard]] bool sounding() const noexcept { return sounding_; }
  [[nodiscard]] std::uint64_t author() const noexcept { return target_.author; }
  [[nodiscard]] HandpieceKind kind() const noexcept { return target_.handpiece; }
  [[nodiscard]] double rpm() const noexcept { return rpm_; }

 private:
  void advance_controls() noexcept;
  void add_partials(Block& block) noexcept;
  void add_noise(Block& block) noexcept;
  void add_knock(Block& block) noexcept;
  [[nodiscard]] double source_gain(Source source) const noexcept;

  const Handpiece* handpiece_ = nullptr;  // owned by the synth, outlives the voice
  VoiceParams params_;
  double rate_hz_ = 48000;
  ToolSound target_;
  bool sounding_ = false;
  WhiteNoise noise_;

  double span_rpm_ = 0;  // the highest speed of this run: determines how fast it runs up and down
  double slewed_rpm_ = 0, rpm_ = 0;
  double load_ = 0, hardness_ = 0, chips_ = 0;
  double drive_ = 0;       // load weighted by hardness: determines the loudness
  double tone_drive_ = 0;  // its square root, for sources that respond to small loads

  std::array<double, kMaxPartials> phase_{};  // turns
  std::array<float, kMaxPartials> level_{};   // at the end of the last block
  std::array<float, kMaxPartials> flutter_{};
  double tooth_phase_ = 0;
  BandPass chip_filter_, air_filter_;
  float chip_level_ = 0, air_level_ = 0;

  double recent_load_ = 0;  // falls slowly: the load of a moment ago
  std::array<float, 2> knock_re_{}, knock_im_{};
};

}  // namespace osteon::audio
