// Keeps the mix within full scale without distortion: it lowers the gain in time instead of clipping.
#pragma once
#include "audio_client/space/block.hpp"

namespace osteon::audio {

// The gain changes linearly through a block. It goes from the last block's gain to one that suits this block and the
// next. So at both ends, and therefore everywhere, it is small enough for this block's peak. Both channels have one
// gain: a loud tool at one side does not move the others.
class Limiter {
 public:
  // Takes the block that was just rendered and returns the one before it, limited.
  void process(StereoBlock& block) noexcept;
  void reset() noexcept;

 private:
  static constexpr float kCeiling = 0.97F;
  static constexpr float kRecovery = 0.01F;  // per block: recovers 20 dB in about 0.1 s
  StereoBlock waiting_;
  float waiting_gain_ = 1;  // the largest gain that the waiting block permits
  float gain_ = 1;          // at the end of the last returned block
};

}  // namespace osteon::audio
