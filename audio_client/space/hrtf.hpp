// Head-related transfer functions: how head and ears change a sound that comes from a direction. Each ear has a delay
// and a short filter of minimum phase, which can be interpolated between directions.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::audio {

// A measured impulse response of both ears. Frame of the head: x ahead, y left, z up.
struct HeadResponse {
  Vec3 towards = Vec3::UnitX();  // the source; of any length but 0
  std::vector<float> left, right;
};

inline constexpr int kEarTaps = 96;  // 2 ms at 48 kHz; in KEMAR's ears 1 % of the energy comes later
using EarFilter = std::array<float, kEarTaps>;

struct EarResponse {
  EarFilter filter{};
  double delay_s = 0;  // after the moment at which the sound would reach the middle of the head; may be negative
};
struct EarPair {
  EarResponse left, right;
};

class Hrtf {
 public:
  static constexpr int kMostTaps = 1024;  // of a measured response; longer ones are of rooms, not of heads

  // Noise of 400 to 6000 Hz from straight ahead keeps its power, as the mean of both ears. Errors, invalid_input: fewer
  // than 4 directions; responses that are empty, too long, not finite, or silent ahead.
  [[nodiscard]] static Result<Hrtf> make(std::span<const HeadResponse> measured, double rate_hz);

  // What reaches the ears from a direction, a unit vector. It is continuous in the direction. [audio]
  void towards(const Vec3& direction, EarPair& ears) const noexcept;

 private:
  static constexpr int kStep_degrees = 5, kAzimuths = 360 / kStep_degrees, kElevations = 180 / kStep_degrees + 1;

  Hrtf() = default;
  std::vector<EarPair> nodes_;  // kAzimuths for each elevation from -90 to 90 degrees, from ahead to the left
};

}  // namespace osteon::audio
