// The hiss of a sucker: air and water in a thin tube. Broadband noise that swells and fades without a click. Its pitch
// and level are assumptions [A]. It does not depend on what the sucker touches.
#pragma once
#include <cstdint>

#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/noise.hpp"

namespace osteon::audio {

struct SuctionParams {
  double centre_hz = 1800.0, quality = 0.6;  // of the noise's band
  double level = 0.03;                       // softer than a drill that runs free
  double swell_s = 0.06;                     // time constant of swelling and fading
};

class SuctionSound {
 public:
  // `seed`: of the noise.
  void prepare(const SuctionParams& params, double rate_hz, std::uint64_t seed) noexcept;
  void aim(bool on) noexcept { on_ = on; }
  void add_to(Block& block) noexcept;  // the next kBlockFrames
  [[nodiscard]] bool sounding() const noexcept { return on_ || level_ > 0.0F; }

 private:
  SuctionParams params_;
  double rate_hz_ = 48000;
  WhiteNoise noise_;
  BandPass band_;
  float level_ = 0;  // at the end of the last block
  bool on_ = false;
};

}  // namespace osteon::audio
