// The windows and the transform that all spectra share.
#pragma once
#include <complex>
#include <memory>
#include <span>
#include <vector>

struct kiss_fftr_state;

namespace osteon::sound {

// Hann window w[k] = 0.5 (1 - cos(2 pi k / size)), k = 0 ... size - 1. It is periodic, as spectra and
// overlap-add use it; (8.8) divides by size - 1, and is the symmetric form. `size`: even, at least 2.
[[nodiscard]] std::vector<float> hann_window(int size);

// Sum of the squared samples of a window.
[[nodiscard]] double window_energy(std::span<const float> window);

// Discrete Fourier transform (8.5, 8.6) of `size` real samples. It owns its scratch memory: one thread at a time.
class RealFft {
 public:
  explicit RealFft(int size);  // even, at least 4; powers of two are fastest
  ~RealFft();
  RealFft(RealFft&&) noexcept;
  RealFft& operator=(RealFft&&) noexcept;

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] std::size_t bins() const { return static_cast<std::size_t>(size_) / 2 + 1; }

  // X[k] = sum over i of x[i] exp(-2 pi j i k / size), for k = 0 ... size / 2. `time`: size samples. `spectrum`:
  // bins().
  void forward(std::span<const float> time, std::span<std::complex<float>> spectrum);
  // The inverse, with the factor 1 / size: forward() and inverse() return the samples.
  void inverse(std::span<const std::complex<float>> spectrum, std::span<float> time);

 private:
  struct Free {
    void operator()(kiss_fftr_state* plan) const;
  };
  int size_;
  std::unique_ptr<kiss_fftr_state, Free> forward_, inverse_;
};

}  // namespace osteon::sound
