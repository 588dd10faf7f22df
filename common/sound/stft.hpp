// Short-time Fourier transform with Hann windows (8.7), its inverse by overlap-add (8.20), and the spectrogram.
#pragma once
#include <complex>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace osteon::sound {

struct StftParams {
  int window = 1024;  // samples of a frame, even
  int hop = 512;      // samples from one frame to the next, at most half of the window
  int size = 1024;    // samples of the transform, even; beyond the window they are zero
};

// Calls `take` with each frame's number and bins 0 ... size / 2, in order. Nothing is kept, so a recording may be long.
// Frames are those of Stft.
void for_each_frame(std::span<const float> samples, const StftParams& params,
                    const std::function<void(std::size_t frame, std::span<const std::complex<float>> bins)>& take);

// By it |X|^2 becomes power as in Spectrum: the sum over the bins, the inner ones doubled, is the mean square of the
// signal under the window.
[[nodiscard]] double power_scale(const StftParams& params);

// Sum of |X|^2 over the bins in [from_hz, to_hz), the inner ones doubled. Times power_scale(), the mean square of that
// part of the signal.
[[nodiscard]] double band_energy(std::span<const std::complex<float>> bins, double rate_hz, double from_hz,
                                 double to_hz);

// Frame m has its middle at sample m * hop: it covers [m * hop - window / 2, m * hop + window / 2), and the signal is
// silent outside its samples. The phase of a bin is that at the frame's first sample.
struct Stft {
  double rate_hz = 0;
  StftParams params;
  std::size_t samples = 0;                  // of the signal
  std::size_t frames = 0;                   // the last middle is not before the last sample
  std::vector<std::complex<float>> values;  // frames rows of bins() values

  [[nodiscard]] std::size_t bins() const { return static_cast<std::size_t>(params.size) / 2 + 1; }
  [[nodiscard]] std::span<const std::complex<float>> frame(std::size_t m) const {
    return std::span(values).subspan(m * bins(), bins());
  }
  [[nodiscard]] std::span<std::complex<float>> frame(std::size_t m) {
    return std::span(values).subspan(m * bins(), bins());
  }
};

[[nodiscard]] Stft stft(std::span<const float> samples, double rate_hz, const StftParams& params = {});

// The signal whose transform is closest to `transform` in the sum of squared differences: each frame is windowed again,
// and the sum is divided by that of the squared windows (Griffin 1984). Of an unchanged transform, the signal itself.
[[nodiscard]] std::vector<float> inverse_stft(const Stft& transform);

// Mean power over time and frequency, for a picture or a table: a long recording has as many columns as a short one.
struct Spectrogram {
  double column_s = 0;  // from one column to the next
  double bin_hz = 0;
  std::size_t columns = 0, bins = 0;
  std::vector<float> power;  // columns rows of bins values: mean square in each bin

  [[nodiscard]] float at(std::size_t column, std::size_t bin) const { return power[column * bins + bin]; }
};

// `window`: samples of a frame, even. Frames overlap by three quarters. Each column is the mean of one or more of them,
// so that there are at most `most_columns`, at least 1. Column c begins at c * column_s.
[[nodiscard]] Spectrogram spectrogram(std::span<const float> samples, double rate_hz, int window,
                                      std::size_t most_columns);

}  // namespace osteon::sound
