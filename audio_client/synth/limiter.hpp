// Keeps the mix within full scale without distorting it: lowers the gain in time instead of clipping.
#pragma once
#include <array>
#include <span>

namespace osteon::audio {

// Frames rendered together: parameters move linearly inside, the limiter looks one such block ahead.
inline constexpr int kBlockFrames = 64;
using Block = std::array<float, kBlockFrames>;

// The gain runs linearly through a block from the last block's to one that suits this block and the next, so at both
// ends, and so everywhere, it is small enough for this block's peak.
class Limiter {
 public:
  // Takes the block that was just rendered and gives back the one before it, limited.
  void process(Block& block) noexcept;
  void reset() noexcept;

 private:
  static constexpr float kCeiling = 0.97F;
  static constexpr float kRecovery = 0.01F;  // per block: 20 dB come back in about 0.1 s
  Block waiting_{};
  float waiting_gain_ = 1;  // the largest gain that the waiting block allows
  float gain_ = 1;          // at the end of the last block given back
};

}  // namespace osteon::audio
