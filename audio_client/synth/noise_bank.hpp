// Noise with a given density over frequency: a bank of band-pass filters on one white noise.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "audio_client/presets/tool_model.hpp"
#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/noise.hpp"

namespace osteon::audio {

class NoiseBank {
 public:
  // Solves for the gains of the bands, so that their sum has the densities of the points. May allocate.
  void prepare(const std::vector<NoisePoint>& points, double rate_hz);

  // [audio] Adds noise whose amplitude is multiplied by a factor that goes from `from` to `to` through the block.
  void add_to(Block& block, WhiteNoise& white, float from, float to) noexcept;
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  void reset() noexcept { s1_.fill(0), s2_.fill(0); }

 private:
  using Lanes = std::array<float, kMostNoisePoints>;
  std::size_t count_ = 0;
  Lanes gain_{}, a1_{}, a2_{}, a3_{}, s1_{}, s2_{};
};

}  // namespace osteon::audio
