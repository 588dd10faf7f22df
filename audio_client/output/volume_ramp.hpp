// The listener's volume. It moves at a constant speed, so that a change makes no click.
#pragma once
#include <algorithm>
#include <span>

namespace osteon::audio {

class VolumeRamp {
 public:
  static constexpr double kWhole_s = 0.03;  // from silence to full volume

  explicit VolumeRamp(double rate_hz) : step_(1.0 / (kWhole_s * rate_hz)) {}

  // Multiplies each sample by a factor that moves to `wanted`, 0 to 1. [audio]
  void apply(std::span<float> mono, double wanted) noexcept {
    if (!begun_) factor_ = wanted;  // nothing was heard before
    begun_ = true;
    for (float& x : mono) {
      factor_ += std::clamp(wanted - factor_, -step_, step_);
      x = static_cast<float>(factor_ * x);
    }
  }

 private:
  double step_;
  double factor_ = 0.0;
  bool begun_ = false;
};

}  // namespace osteon::audio
