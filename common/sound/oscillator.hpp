// One oscillator of a bank: a sinusoid from one point of its envelopes to the next.
#pragma once
#include <cmath>
#include <cstddef>
#include <span>

#include "common/sound/spectral_peaks.hpp"

namespace osteon::sound {

// cos(2 pi turns), within 1e-6, much faster than that of the library. Fails beyond 2e9 turns.
[[nodiscard]] inline float cosine(double turns) {
  // With u in 0 ... 1, cos(2 pi u) = sin(2 pi x) at x = |u - 1/2| - 1/4, which is at most 1/4.
  const double u = std::abs(turns - static_cast<double>(static_cast<int>(turns)));
  const auto x = static_cast<float>(std::abs(u - 0.5) - 0.25);
  const float s = x * x;
  return x * (6.28318516F + s * (-41.3416550F + s * (81.6009976F + s * (-76.5496429F + s * 39.5357024F))));
}

// Adds the sinusoid that goes from `from`, at sample `begin`, to `to`, `count` samples later, the amplitude along a
// line, the phase along the cubic of McAulay 1986 (eq. 33 to 37). Samples outside `sound` are left out.
void add_cubic(std::span<float> sound, std::ptrdiff_t begin, int count, const Sinusoid& from, const Sinusoid& to,
               double rate_hz);

// The same without phases of the points: the phase begins at `turns` and follows the frequency, which goes along a
// line. Returns the turns at the end, within 0 ... 1.
double add_linear(std::span<float> sound, std::ptrdiff_t begin, int count, const Sinusoid& from, const Sinusoid& to,
                  double turns, double rate_hz);

}  // namespace osteon::sound
