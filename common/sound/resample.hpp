// Another sampling rate for a recording.
#pragma once
#include <span>
#include <vector>

namespace osteon::sound {

// The signal at `to_hz`, band-limited, without delay: sample i is the signal at i / to_hz. Its length is that of the
// signal, rounded. The filter is libsamplerate's "medium" sinc: 121 dB below full scale, while 16 bits reach 98 dB. It
// passes 90 % of the band below half of the lower rate. Rates in Hz, above 0, their ratio 1/256 to 256.
[[nodiscard]] std::vector<float> resampled(std::span<const float> samples, double from_hz, double to_hz);

}  // namespace osteon::sound
