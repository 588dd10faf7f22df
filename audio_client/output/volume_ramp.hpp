// The listener's volume. It moves at a constant speed, so that a change makes no click.
#pragma once
#include <algorithm>
#include <cstddef>
#include <span>

namespace osteon::audio {

class VolumeRamp {
 public:
  static constexpr double kWhole_s = 0.03;  // from silence to full volume

  explicit VolumeRamp(double rate_hz) : step_(1.0 / (kWhole_s * rate_hz)) {}

  // Multiplies the frames of both channels, of equal sizes, by a factor that moves to `wanted`, 0 to 1. [audio]
  void apply(std::span<float> left, std::span<float> right, double wanted) noexcept {
    if (!begun_) factor_ = wanted;  // nothing was heard before
    begun_ = true;
    for (std::size_t i = 0; i < left.size(); ++i) {
      factor_ += std::clamp(wanted - factor_, -step_, step_);
      left[i] = static_cast<float>(factor_ * left[i]);
      right[i] = static_cast<float>(factor_ * right[i]);
    }
  }

 private:
  double step_;
  double factor_ = 0.0;
  bool begun_ = false;
};

}  // namespace osteon::audio
