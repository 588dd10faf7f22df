#include "audio_client/synth/suction_sound.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::audio {
namespace {

constexpr float kInaudible = 1e-4F;  // of the preset's level

}  // namespace

void SuctionSound::prepare(const SuctionParams& params, const ToolModel& model, double rate_hz, std::uint64_t seed) {
  params_ = params;
  rate_hz_ = rate_hz;
  seed_ = seed;
  depth_ = static_cast<float>(model.chips.depth);
  bank_.prepare(model.noise, rate_hz);
  reset();
}

void SuctionSound::reset() noexcept {
  noise_ = WhiteNoise(seed_);
  bank_.reset();
  bubbles_ = level_ = factor_ = 0;
  on_ = false;
}

void SuctionSound::add_to(Block& block) noexcept {
  const auto share = static_cast<float>(1.0 - std::exp(-kBlockFrames / (params_.swell_s * rate_hz_)));
  const auto wanted = on_ ? static_cast<float>(params_.level) : 0.0F;
  level_ += share * (wanted - level_);
  if (!on_ && level_ < kInaudible) level_ = 0.0F;
  // Bubbles of water: slow noise of variance 1, as in Voice's flutter.
  const auto bubble = static_cast<float>(1.0 - std::exp(-kBlockFrames / (params_.bubble_s * rate_hz_)));
  bubbles_ += bubble * (noise_.next() - bubbles_);
  const float gurgle = 0.5F * depth_ * bubbles_ * std::sqrt(3.0F * (2.0F - bubble) / bubble);
  const float to = level_ * std::clamp(1.0F + gurgle, 0.0F, 2.0F);
  bank_.add_to(block, noise_, factor_, to);
  factor_ = to;
}

}  // namespace osteon::audio
