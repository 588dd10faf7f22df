#include "common/sound/partials.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

#include "common/core/check.hpp"
#include "common/sound/oscillator.hpp"

namespace osteon::sound {
namespace {

using std::numbers::pi;

constexpr std::size_t kFramesPerReport = 64;
constexpr std::size_t kShortestFrame = 32;

struct Pair {
  double apart_hz = 0;
  std::size_t partial = 0, peak = 0;
};

// The last cut after sample `from`, up to `to`.
std::optional<std::size_t> cut_between(std::size_t from, std::size_t to, std::span<const std::size_t> cuts) {
  std::optional<std::size_t> last;
  for (const std::size_t cut : cuts)
    if (cut > from && cut <= to) last = std::max(last.value_or(0), cut);
  return last;
}

}  // namespace

std::vector<std::vector<Sinusoid>> frame_peaks(std::span<const float> samples, double rate_hz,
                                               const PartialParams& params, std::span<const std::size_t> cuts,
                                               const KeepGoing& keep_going) {
  OSTEON_CHECK(params.window >= 32 && params.window % 2 == 0 && params.hop >= 1);
  const auto window = static_cast<std::size_t>(params.window), hop = static_cast<std::size_t>(params.hop);
  std::map<std::size_t, PeakFinder> finders;  // by the samples of their frames
  std::vector<std::vector<Sinusoid>> frames(samples.size() / hop + 1);
  for (std::size_t m = 0; m < frames.size(); ++m) {
    if (m % kFramesPerReport == 0 && !keep_going(static_cast<double>(m) / static_cast<double>(frames.size()))) break;
    const std::size_t middle = m * hop;
    std::size_t end = samples.size();  // of what the frame may see
    for (const std::size_t cut : cuts)
      if (cut > middle) end = std::min(end, cut);
    const std::size_t size = std::min(window, end / 2 * 2);
    if (size < kShortestFrame) continue;
    const std::size_t begin = std::min(middle > size / 2 ? middle - size / 2 : 0, end - size);
    auto finder = finders.find(size);
    if (finder == finders.end())
      finder = finders.emplace(size, PeakFinder(static_cast<int>(size), rate_hz, params.peaks)).first;
    frames[m] = finder->second.find(samples.subspan(begin, size));
    const double later_s = (static_cast<double>(middle) - static_cast<double>(begin + size / 2)) / rate_hz;
    for (Sinusoid& peak : frames[m]) peak.phase = std::remainder(peak.phase + 2.0 * pi * peak.hz * later_s, 2.0 * pi);
  }
  return frames;
}

std::vector<Partial> continued(std::span<const std::vector<Sinusoid>> frames, double rate_hz,
                               const PartialParams& params, std::span<const std::size_t> cuts) {
  std::vector<Partial> all;
  const auto hop = static_cast<std::size_t>(params.hop);
  std::vector<std::size_t> living;  // those with a point in the frame before
  std::vector<Pair> pairs;
  for (std::size_t m = 0; m < frames.size(); ++m) {
    const std::vector<Sinusoid>& peaks = frames[m];
    pairs.clear();
    if (m > 0 && cut_between((m - 1) * hop, m * hop, cuts)) living.clear();
    for (const std::size_t partial : living) {
      const double hz = all[partial].points.back().hz, reach_hz = params.step_hz + params.step_part * hz;
      auto peak = std::ranges::lower_bound(peaks, hz - reach_hz, {}, &Sinusoid::hz);
      for (; peak != peaks.end() && peak->hz <= hz + reach_hz; ++peak)
        pairs.push_back({std::abs(peak->hz - hz), partial, static_cast<std::size_t>(peak - peaks.begin())});
    }
    std::ranges::sort(pairs, [](const Pair& a, const Pair& b) {
      return std::tie(a.apart_hz, a.partial, a.peak) < std::tie(b.apart_hz, b.partial, b.peak);
    });
    std::vector<bool> taken(peaks.size(), false);
    std::vector<std::size_t> next;
    for (const Pair& pair : pairs) {
      Partial& partial = all[pair.partial];
      if (taken[pair.peak] || partial.first + partial.points.size() > m) continue;
      taken[pair.peak] = true;
      partial.points.push_back(peaks[pair.peak]);
      next.push_back(pair.partial);
    }
    for (std::size_t k = 0; k < peaks.size(); ++k) {
      if (taken[k]) continue;
      next.push_back(all.size());
      all.push_back({.first = m, .points = {peaks[k]}});
    }
    living = std::move(next);
  }
  const double least = params.shortest_s * rate_hz / params.hop;
  std::erase_if(all, [&](const Partial& p) { return static_cast<double>(p.points.size()) < least; });
  return all;
}

std::vector<float> sound_with_phases(std::span<const Partial> partials, double rate_hz, int hop, std::size_t samples,
                                     std::span<const std::size_t> cuts) {
  std::vector<float> sound(samples, 0.0F);
  for (const Partial& partial : partials) {
    if (partial.points.empty()) continue;
    std::vector<Sinusoid> points = partial.points;
    const double hop_s = hop / rate_hz;
    // Born and dead a hop away, at the same frequency, with no amplitude.
    Sinusoid birth = points.front(), death = points.back();
    birth.amplitude = death.amplitude = 0;
    birth.phase -= 2.0 * pi * birth.hz * hop_s;
    death.phase += 2.0 * pi * death.hz * hop_s;
    const auto begin = static_cast<std::ptrdiff_t>(partial.first) * hop;
    const std::size_t first = partial.first * static_cast<std::size_t>(hop);
    const auto cut = first > 0 ? cut_between(first - static_cast<std::size_t>(hop), first, cuts) : std::nullopt;
    if (!cut) add_cubic(sound, begin - hop, hop, birth, points.front(), rate_hz);
    if (cut && *cut < first) {
      const int count = static_cast<int>(first - *cut);
      birth = points.front();
      birth.phase -= 2.0 * pi * birth.hz * count / rate_hz;
      add_cubic(sound, begin - count, count, birth, points.front(), rate_hz);
    }
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
      add_cubic(sound, begin + static_cast<std::ptrdiff_t>(i) * hop, hop, points[i], points[i + 1], rate_hz);
    add_cubic(sound, begin + (static_cast<std::ptrdiff_t>(points.size()) - 1) * hop, hop, points.back(), death,
              rate_hz);
  }
  return sound;
}

}  // namespace osteon::sound
