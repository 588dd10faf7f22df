#include "audio_client/synth/suction_sound.hpp"

#include <cmath>

namespace osteon::audio {
namespace {

constexpr float kInaudible = 1e-5F;

}  // namespace

void SuctionSound::prepare(const SuctionParams& params, double rate_hz, std::uint64_t seed) noexcept {
  *this = SuctionSound{};
  params_ = params;
  rate_hz_ = rate_hz;
  noise_ = WhiteNoise(seed);
  band_.set(params.centre_hz, rate_hz, params.quality);
}

void SuctionSound::add_to(Block& block) noexcept {
  const auto share = static_cast<float>(1.0 - std::exp(-kBlockFrames / (params_.swell_s * rate_hz_)));
  const auto wanted = on_ ? static_cast<float>(params_.level) : 0.0F;
  float to = level_ + share * (wanted - level_);
  if (!on_ && to < kInaudible) to = 0.0F;
  const float step = (to - level_) / kBlockFrames;
  for (float& x : block) {
    x += level_ * band_.next(noise_.next());
    level_ += step;
  }
  level_ = to;
}

}  // namespace osteon::audio
