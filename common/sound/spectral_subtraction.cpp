#include "common/sound/spectral_subtraction.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon::sound {
namespace {

double raised(std::complex<float> bin, SubtractionDomain domain) {
  const double power = std::norm(bin);
  return domain == SubtractionDomain::power ? power : std::sqrt(power);
}

}  // namespace

StationarySpectrum stationary_spectrum(const Stft& transform, std::size_t first, std::size_t last,
                                       SubtractionDomain domain) {
  OSTEON_CHECK(first < last && last <= transform.frames);
  StationarySpectrum result{domain, std::vector<double>(transform.bins(), 0.0)};
  for (std::size_t m = first; m < last; ++m) {
    const auto bins = transform.frame(m);
    for (std::size_t k = 0; k < bins.size(); ++k) result.mean[k] += raised(bins[k], domain);
  }
  for (double& mean : result.mean) mean /= static_cast<double>(last - first);
  return result;
}

Stft spectral_subtraction(Stft transform, const StationarySpectrum& stationary) {
  OSTEON_CHECK(stationary.mean.size() == transform.bins());
  for (std::size_t m = 0; m < transform.frames; ++m) {
    const auto bins = transform.frame(m);
    for (std::size_t k = 0; k < bins.size(); ++k) {
      const double all = raised(bins[k], stationary.domain);
      const double part = all > 0 ? std::max(0.0, 1.0 - stationary.mean[k] / all) : 0.0;
      bins[k] *= static_cast<float>(stationary.domain == SubtractionDomain::power ? std::sqrt(part) : part);
    }
  }
  return transform;
}

}  // namespace osteon::sound
