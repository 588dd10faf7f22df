#include "common/sound/levels.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::sound {

double power_db(double mean_square) {
  return mean_square > 0.0 ? std::max(kSilence_db, 10.0 * std::log10(mean_square)) : kSilence_db;
}

double rms_db(std::span<const float> samples) {
  if (samples.empty()) return kSilence_db;
  double sum = 0;
  for (const float x : samples) sum += static_cast<double>(x) * x;
  return power_db(sum / static_cast<double>(samples.size()));
}

double peak(std::span<const float> samples) {
  double largest = 0;
  for (const float x : samples) largest = std::max(largest, std::abs(static_cast<double>(x)));
  return largest;
}

double largest_step(std::span<const float> samples) {
  double largest = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(samples[i]) - samples[i - 1]));
  }
  return largest;
}

}  // namespace osteon::sound
