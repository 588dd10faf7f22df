#include "common/sound/fourier.hpp"

#include <kiss_fftr.h>

#include <cmath>
#include <numbers>

#include "common/core/check.hpp"

namespace osteon::sound {

// std::complex is a pair of numbers in memory, as the library's.
static_assert(sizeof(kiss_fft_cpx) == sizeof(std::complex<float>));

std::vector<float> hann_window(int size) {
  OSTEON_CHECK(size >= 2 && size % 2 == 0);
  std::vector<float> window(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < window.size(); ++i)
    window[i] = static_cast<float>(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / size));
  return window;
}

double window_energy(std::span<const float> window) {
  double sum = 0;
  for (const float w : window) sum += static_cast<double>(w) * w;
  return sum;
}

void RealFft::Free::operator()(kiss_fftr_state* plan) const { kiss_fftr_free(plan); }

RealFft::RealFft(int size) : size_(size) {
  OSTEON_CHECK(size >= 4 && size % 2 == 0);
  forward_.reset(kiss_fftr_alloc(size, 0, nullptr, nullptr));
  inverse_.reset(kiss_fftr_alloc(size, 1, nullptr, nullptr));
  OSTEON_CHECK(forward_ && inverse_);
}

RealFft::~RealFft() = default;
RealFft::RealFft(RealFft&&) noexcept = default;
RealFft& RealFft::operator=(RealFft&&) noexcept = default;

void RealFft::forward(std::span<const float> time, std::span<std::complex<float>> spectrum) {
  OSTEON_CHECK(time.size() == static_cast<std::size_t>(size_) && spectrum.size() == bins());
  kiss_fftr(forward_.get(), time.data(), reinterpret_cast<kiss_fft_cpx*>(spectrum.data()));
}

void RealFft::inverse(std::span<const std::complex<float>> spectrum, std::span<float> time) {
  OSTEON_CHECK(time.size() == static_cast<std::size_t>(size_) && spectrum.size() == bins());
  kiss_fftri(inverse_.get(), reinterpret_cast<const kiss_fft_cpx*>(spectrum.data()), time.data());
  const float scale = 1.0F / static_cast<float>(size_);
  for (float& x : time) x *= scale;
}

}  // namespace osteon::sound
