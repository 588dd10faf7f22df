#include "common/sound/levels.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon::sound {

double power_db(double mean_square) {
  return mean_square > 0.0 ? std::max(kSilence_db, 10.0 * std::log10(mean_square)) : kSilence_db;
}

double amplitude_of_db(double db) noexcept { return std::pow(10.0, 0.05 * db); }

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

double sound_level_db(double level_db, double full_scale_pa) {
  OSTEON_CHECK(full_scale_pa > 0);
  return level_db + 20.0 * std::log10(full_scale_pa / kReference_pa);
}

std::vector<double> block_levels_db(std::span<const float> samples, std::size_t block) {
  OSTEON_CHECK(block >= 1);
  std::vector<double> levels;
  for (std::size_t at = 0; at < samples.size(); at += block)
    levels.push_back(rms_db(samples.subspan(at, std::min(block, samples.size() - at))));
  return levels;
}

}  // namespace osteon::sound
