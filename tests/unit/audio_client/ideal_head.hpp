// Heads whose ears are known by formula, as if they had been measured.
#pragma once
#include <functional>
#include <numbers>
#include <vector>

#include "audio_client/space/hrtf.hpp"

namespace osteon::test {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kHeadRadius_mm = 87.5;  // Woodworth's and Kuhn's

// The delay of an ear of a rigid sphere (Woodworth 1938) for a far source, from the moment at which its sound would
// reach the middle. `along`: cosine of the angle between source and ear. The near ear is reached straight, and the far
// one round the sphere.
[[nodiscard]] double woodworth_delay_s(double along);

// The measured impulses end here.
inline constexpr double kImpulse_hz = 22'500;

// Level of an ear, by the same cosine.
using EarLevel = std::function<double(double along)>;

// Measurements in steps of 10 degrees at 48 kHz: impulses with Woodworth's delays, and 2 ms before them.
[[nodiscard]] std::vector<audio::HeadResponse> sphere(const EarLevel& level);

}  // namespace osteon::test
