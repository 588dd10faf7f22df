#include "audio_client/synth/limiter.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::audio {

void Limiter::process(StereoBlock& block) noexcept {
  float peak = 0;
  for (const Block* channel : {&block.left, &block.right})
    for (const float x : *channel) peak = std::max(peak, std::abs(x));
  const float allowed = peak > kCeiling ? kCeiling / peak : 1.0F;

  std::swap(waiting_, block);
  const float end = std::min({waiting_gain_, allowed, gain_ + kRecovery, 1.0F});
  waiting_gain_ = allowed;
  if (gain_ < 1.0F || end < 1.0F) {
    const float step = (end - gain_) / kBlockFrames;
    for (Block* channel : {&block.left, &block.right}) {
      float gain = gain_;
      for (float& x : *channel) x *= (gain += step);
    }
  }
  gain_ = end;
}

void Limiter::reset() noexcept { *this = Limiter{}; }

}  // namespace osteon::audio
