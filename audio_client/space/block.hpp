// Frames that are rendered together, of one source or for both ears.
#pragma once
#include <array>

namespace osteon::audio {

// Parameters change linearly inside a block; the limiter looks one block ahead.
inline constexpr int kBlockFrames = 64;
using Block = std::array<float, kBlockFrames>;

struct StereoBlock {
  Block left{}, right{};
};

}  // namespace osteon::audio
