#include "common/sound/transients.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/check.hpp"
#include "common/sound/levels.hpp"

namespace osteon::sound {
namespace {

struct Impact {
  std::size_t at = 0;
  double rise_db = 0;
};

std::size_t samples_in(double seconds, double rate_hz) { return static_cast<std::size_t>(seconds * rate_hz); }

// The first sample in [begin, end) of at least a quarter of the largest magnitude there.
std::size_t onset(std::span<const float> samples, std::size_t begin, std::size_t end) {
  const std::span<const float> part = samples.subspan(begin, end - begin);
  const double least = 0.25 * peak(part);
  const auto found = std::ranges::find_if(part, [&](float x) { return std::abs(x) >= least; });
  return begin + static_cast<std::size_t>(found - part.begin());
}

}  // namespace

std::vector<std::size_t> impacts(std::span<const float> samples, double rate_hz, const TransientParams& params) {
  OSTEON_CHECK(params.length_s > 0 && params.length_s <= kLongestTransient_s && params.most_part <= kMostTransientPart);
  const std::size_t block = samples_in(params.block_s, rate_hz);
  OSTEON_CHECK(block >= 1 && params.before_s >= params.block_s);
  const std::vector<double> levels = block_levels_db(samples.first(samples.size() / block * block), block);
  if (levels.empty()) return {};
  const double least = *std::ranges::max_element(levels) - params.range_db;
  const auto before = static_cast<std::size_t>(params.before_s / params.block_s);
  std::vector<Impact> found;
  for (std::size_t i = before; i < levels.size(); ++i) {
    const double loudest = *std::max_element(levels.begin() + static_cast<std::ptrdiff_t>(i - before),
                                             levels.begin() + static_cast<std::ptrdiff_t>(i));
    // An impact may begin late in its block: the next one then has its full level.
    const double level = i + 1 < levels.size() ? std::max(levels[i], levels[i + 1]) : levels[i];
    if (level < least || level - loudest < params.rise_db || levels[i] - loudest < 0.5 * params.rise_db) continue;
    found.push_back({onset(samples, i * block, (i + 1) * block), level - loudest});
  }
  // The clearest first, as many as there is room for, none within another.
  std::ranges::stable_sort(found, std::greater{}, &Impact::rise_db);
  const std::size_t length = samples_in(params.length_s, rate_hz);
  const auto most = static_cast<std::size_t>(params.most_part * static_cast<double>(samples.size())) / length;
  std::vector<std::size_t> kept;
  for (const Impact& impact : found) {
    const bool apart = std::ranges::all_of(
        kept, [&](std::size_t other) { return (other > impact.at ? other - impact.at : impact.at - other) >= length; });
    if (kept.size() < most && apart) kept.push_back(impact.at);
  }
  std::ranges::sort(kept);
  return kept;
}

std::vector<float> transient_weight(std::size_t count, double rate_hz) {
  const std::size_t lead = samples_in(kTransientLead_s, rate_hz), fade = samples_in(kTransientFade_s, rate_hz);
  const auto flank = [](std::size_t i, std::size_t size) {
    return 0.5 - 0.5 * std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(size));
  };
  std::vector<float> weight(count, 1.0F);
  for (std::size_t i = 0; i < count; ++i) {
    if (i < lead) weight[i] *= static_cast<float>(flank(i, lead));
    if (count - 1 - i < fade) weight[i] *= static_cast<float>(flank(count - 1 - i, fade));
  }
  return weight;
}

std::vector<Transient> transients_at(std::span<const float> samples, double rate_hz,
                                     std::span<const std::size_t> impacts, const TransientParams& params) {
  std::vector<Transient> transients;
  for (const std::size_t at : impacts) {
    const std::size_t lead = std::min(at, samples_in(kTransientLead_s, rate_hz));
    Transient transient{.begin = at - lead, .samples = {}};
    const std::size_t count = std::min(samples_in(params.length_s, rate_hz), samples.size() - transient.begin);
    const std::vector<float> weight = transient_weight(count, rate_hz);
    for (std::size_t i = 0; i < count; ++i) transient.samples.push_back(weight[i] * samples[transient.begin + i]);
    transients.push_back(std::move(transient));
  }
  return transients;
}

void put_transients(std::span<float> sound, std::span<const Transient> transients, double rate_hz) {
  for (const Transient& transient : transients) {
    const std::vector<float> weight = transient_weight(transient.samples.size(), rate_hz);
    for (std::size_t i = 0; i < weight.size() && transient.begin + i < sound.size(); ++i) {
      float& x = sound[transient.begin + i];
      x = (1.0F - weight[i]) * x + transient.samples[i];
    }
  }
}

}  // namespace osteon::sound
