// Keeps the mix within full scale without distortion: it lowers the gain in time instead of clipping.
#pragma once
#include <array>
#include <span>

namespace osteon::audio {

// Number of frames rendered together. Parameters change linearly inside a block; the limiter looks one block ahead.
inline constexpr int kBlockFrames = 64;
using Block = std::array<float, kBlockFrames>;

// The gain changes linearly through a block. It goes from the last block's gain to one that suits this block and the
// next. So at both ends, and therefore everywhere, it is small enough for this block's peak.
class Limiter {
 public:
  // Takes the block that was just rendered and returns the one before it, limited.
  void process(Block& block) noexcept;
  void reset() noexcept;

 private:
  static constexpr float kCeiling = 0.97F;
  static constexpr float kRecovery = 0.01F;  // per block: recovers 20 dB in about 0.1 s
  Block waiting_{};
  float waiting_gain_ = 1;  // the largest gain that the waiting block permits
  float gain_ = 1;          // at the end of the last returned block
};

}  // namespace osteon::audio
