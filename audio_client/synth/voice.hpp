// The sound of one tool: partials that are orders of one spindle, noise, the bone and the blade that ring, and blows.
#pragma once
#include <array>
#include <cstdint>

#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/modal_bank.hpp"
#include "audio_client/synth/noise.hpp"
#include "audio_client/synth/noise_bank.hpp"
#include "audio_client/synth/sound_scene.hpp"
#include "audio_client/synth/spindle_motor.hpp"

namespace osteon::audio {

// Constants of the sound that do not belong to the hand piece.
struct VoiceParams {
  double smoothing_s = 0.005;  // of speed and load: hides the steps between states
  double noise = 1.0;          // gain of all noise, 0 leaves the partials
  double flutter = 0.12;  // slow unsteadiness of each partial's level, relative (8.5.4: sources are not stationary)
};

class Voice {
 public:
  // A tool that is driven by blows is silent until the next one.
  void start(const Handpiece& handpiece, const VoiceParams& params, double rate_hz, const ToolSound& tool,
             std::uint64_t seed) noexcept;
  void aim(const ToolSound& tool) noexcept;  // its target sound from now on
  void release() noexcept;                   // runs down
  void add_to(Block& block) noexcept;        // the next kBlockFrames

  [[nodiscard]] bool sounding() const noexcept { return sounding_; }
  // Silent perhaps, but another tool must not take it: it has counted the blows on its tool.
  [[nodiscard]] bool waits() const noexcept { return waits_; }
  [[nodiscard]] std::uint64_t author() const noexcept { return target_.author; }
  [[nodiscard]] const Handpiece* handpiece() const noexcept { return handpiece_; }  // null: never started
  [[nodiscard]] double rpm() const noexcept { return rpm_; }

 private:
  void break_through(const ToolSound& tool) noexcept;
  void follow_in_bone(const ToolSound& tool) noexcept;
  [[nodiscard]] bool fell_on(const ToolSound& tool) const noexcept;
  void blow(const ToolSound& tool) noexcept;
  void advance_controls() noexcept;
  void add_partials(Block& block) noexcept;
  void add_cut(Block& block) noexcept;
  void tune_cut() noexcept;
  void add_modes(Block& block) noexcept;
  void add_click(Block& block) noexcept;

  const Handpiece* handpiece_ = nullptr;  // owned by the synth, outlives the voice
  VoiceParams params_;
  double rate_hz_ = 48000;
  ToolSound target_;
  bool sounding_ = false, waits_ = false;
  WhiteNoise noise_;

  SpindleMotor motor_;
  double rpm_ = 0;
  double turns_ = 0;  // of the spindle since the start: the one phase of all partials
  double load_ = 0, hardness_ = 0, chips_ = 0, cortex_mm_ = 0;
  double perforated_ = 0;
  Gains gains_;

  std::array<double, kMaxPartials> offset_{};  // turns
  std::array<float, kMaxPartials> level_{};    // at the end of the last block
  std::array<float, kMaxPartials> flutter_{};

  NoiseBank air_;
  float air_level_ = 0;
  BandPass chip_filter_, plate_filter_;
  std::array<BandPass, kBladeModes> blade_filters_;
  std::array<float, kBladeModes> blade_levels_{};
  float chip_level_ = 0, chip_to_ = 0, plate_level_ = 0, plate_to_ = 0, blade_level_ = 0, blade_to_ = 0;

  double recent_load_ = 0, recent_bone_g_cm3_ = 0;  // fall slowly: those of a moment ago
  // Of the last state with the tool in bone: its tip, its time or 0, and how long ago it was heard.
  Vec3 bone_tip_mm_ = Vec3::Zero();
  std::int64_t bone_ns_ = 0;
  double since_bone_s_ = 1;  // it was in none yet
  ModalBank burst_, modes_;
  std::uint32_t blows_ = 0;
  std::size_t click_at_ = 0, click_ = 0;  // of a recorded click
  float click_level_ = 0;
};

}  // namespace osteon::audio
