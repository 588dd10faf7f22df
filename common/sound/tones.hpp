// Measures single tones in a signal to a small fraction of a hertz, by a windowed Fourier sum at any frequency.
#pragma once
#include <span>
#include <vector>

namespace osteon::sound {

// Amplitude of the tone at `hz` by a Hann-windowed Goertzel sum, in dB re amplitude 1. Tones closer than 4 / duration
// cannot be separated.
[[nodiscard]] double tone_db(std::span<const float> samples, double rate_hz, double hz);

struct Tone {
  double hz = 0;
  double level_db = 0;  // as tone_db
};
// The strongest tone between `low_hz` and `high_hz`.
[[nodiscard]] Tone find_tone(std::span<const float> samples, double rate_hz, double low_hz, double high_hz);

struct TrackParams {
  int window = 4096;        // samples analysed together
  int hop = 1024;           // samples from one point of the track to the next
  double reach = 0.03;      // largest relative change of frequency in one hop
  double quiet_db = -90.0;  // below this level the track keeps its last frequency
};
// Follows one tone through the signal from `start_hz`: one frequency for each hop, at the middle of its window.
[[nodiscard]] std::vector<double> track_tone(std::span<const float> samples, double rate_hz, double start_hz,
                                             const TrackParams& params = {});

}  // namespace osteon::sound
