// The hiss of a sucker, by the preset "suction": broadband noise that gurgles, and swells and fades without a click.
#pragma once
#include <cstdint>

#include "audio_client/presets/tool_model.hpp"
#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/noise.hpp"
#include "audio_client/synth/noise_bank.hpp"

namespace osteon::audio {

struct SuctionParams {
  double level = 1.0;      // factor on the preset's noise
  double swell_s = 0.06;   // time constant of swelling and fading
  double bubble_s = 0.03;  // of the gurgling [A]
};

class SuctionSound {
 public:
  // `seed`: of the noise.
  void prepare(const SuctionParams& params, const ToolModel& model, double rate_hz, std::uint64_t seed);
  void reset() noexcept;  // [audio] silent at once, as after prepare
  void aim(bool on) noexcept { on_ = on; }
  void add_to(Block& block) noexcept;  // the next kBlockFrames
  [[nodiscard]] bool sounding() const noexcept { return on_ || level_ > 0.0F; }

 private:
  SuctionParams params_;
  double rate_hz_ = 48000;
  std::uint64_t seed_ = 1;
  float depth_ = 0;
  WhiteNoise noise_;
  NoiseBank bank_;
  float bubbles_ = 0;
  float level_ = 0;   // at the end of the last block
  float factor_ = 0;  // the same, with the bubbles
  bool on_ = false;
};

}  // namespace osteon::audio
