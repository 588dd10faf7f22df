// Spectral subtraction (8.14-8.20, Boll 1979): what a sound has more than a stationary one, such as a drill that runs
// free. It fails where the other sound is not stationary: a line that moves leaves itself at its new place.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "common/sound/stft.hpp"

namespace osteon::sound {

// The exponent b of (8.18).
enum class SubtractionDomain {
  magnitude = 1,  // if both sounds had the same phase
  power = 2,      // if their phases are unrelated, as 8.5.5 assumes
};

// Mean over some frames of |N(m, k)|^b, for each bin.
struct StationarySpectrum {
  SubtractionDomain domain = SubtractionDomain::power;
  std::vector<double> mean;
};

// Of the frames first ... last - 1; at least one.
[[nodiscard]] StationarySpectrum stationary_spectrum(const Stft& transform, std::size_t first, std::size_t last,
                                                     SubtractionDomain domain = SubtractionDomain::power);

// (8.18, 8.19): each bin's |Y|^b less the mean of the stationary sound, not below 0, with the phase of Y. White noise
// that is subtracted from itself keeps exp(-1) of its power in the transform (-4.34 dB): the power of a bin is
// exponentially distributed about the mean, and what exceeds the mean stays. `transform` has the same parameters as
// that of the stationary sound.
[[nodiscard]] Stft spectral_subtraction(Stft transform, const StationarySpectrum& stationary);

}  // namespace osteon::sound
