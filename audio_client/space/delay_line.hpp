// The sound of one source under way to a listener: what was put in comes out later, by any fraction of a frame.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

#include "audio_client/space/block.hpp"

namespace osteon::audio {

class DelayLine {
 public:
  static constexpr int kFrames = 1024;
  static constexpr double kLeast = 2, kMost = kFrames - kBlockFrames - 2;  // frames of delay

  void push(const Block& block) noexcept {
    at_ = (at_ + kBlockFrames) % kFrames;
    for (std::size_t i = 0; i < block.size(); ++i) frames_[static_cast<std::size_t>(at_) + i] = block[i];
  }

  // The block that was pushed last, or what came before it. The delay goes from `from`, before the first frame, to
  // `to`, at the last one; both are within kLeast and kMost. Frames between those that were pushed lie on the cubic
  // through four of them (Lagrange). Half-way between, that takes 0.2 dB from 8 kHz and 1.1 dB from 12 kHz.
  void read(double from, double to, Block& out) const noexcept {
    const double step = (to - from) / kBlockFrames;
    for (int i = 0; i < kBlockFrames; ++i) {
      const double at = i - (from + step * (i + 1));
      const double whole = std::floor(at);
      const auto t = static_cast<float>(at - whole);
      const int k = at_ + static_cast<int>(whole);
      const float before = (t + 1.0F) * t, after = (t - 1.0F) * (t - 2.0F);
      out[static_cast<std::size_t>(i)] =
          frame(k) * 0.5F * (t + 1.0F) * after - frame(k - 1) * (1.0F / 6.0F) * t * after -
          frame(k + 1) * 0.5F * before * (t - 2.0F) + frame(k + 2) * (1.0F / 6.0F) * before * (t - 1.0F);
    }
  }

  void clear() noexcept { *this = DelayLine{}; }

 private:
  [[nodiscard]] float frame(int k) const noexcept {
    return frames_[static_cast<std::size_t>(k) & static_cast<std::size_t>(kFrames - 1)];
  }

  static_assert((kFrames & (kFrames - 1)) == 0 && kFrames % kBlockFrames == 0, "a power of two, of whole blocks");
  std::array<float, kFrames> frames_{};
  int at_ = 0;  // of the first frame of the newest block
};

}  // namespace osteon::audio
