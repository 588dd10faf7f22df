#include "common/sound/drilling_states.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "common/core/check.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/stft.hpp"

namespace osteon::sound {
namespace {

// Bands in which levels are compared, Hz. Perforation is heard below 400 Hz, and layers up to 7 kHz (8.5.4).
constexpr std::array<double, 5> kEdges_hz = {50, 400, 2756, 5512, 8000};
constexpr std::size_t kBands = kEdges_hz.size() - 1;
constexpr double kFloor_db = -95.0;    // about the rounding of 16 bits; digital silence is not infinitely quiet
constexpr double kSteadiest_db = 0.5;  // pure tones have no noise, and would be divided at every flutter
constexpr double kSustainedLow_s = 0.2, kSustainedHigh_s = 0.4;  // a part that is long enough to be a reference
constexpr double kShortestSpan_s = 0.05;     // shorter ones belong to a neighbour, except perforation
constexpr std::size_t kShortestPart = 3;     // frames
constexpr double kPenaltyForEachBand = 3.0;  // times log(frames): overlapping frames count about twice

struct Levels {
  double frame_s = 0;
  std::size_t frames = 0;
  std::vector<std::array<double, kBands>> power;      // mean square in each band
  std::vector<std::array<double, 2>> motor_and_mesh;  // power around their lines, or both 0
};

Levels levels_of(std::span<const float> samples, double rate_hz, const StateParams& params) {
  const double seconds = static_cast<double>(samples.size()) / rate_hz;
  const double frame_s = std::max(params.frame_s, seconds / kMostFrames);
  StftParams frames{.window = 2, .hop = std::max(1, static_cast<int>(std::lround(frame_s * rate_hz))), .size = 2};
  while (frames.window < 2 * frames.hop) frames.window *= 2;
  frames.size = frames.window;
  const double scale = power_scale(frames);

  const double spindle_hz = params.spindle_rpm / 60.0;
  const Gearbox gears;
  const std::array<double, 2> lines_hz = {3.0 * kCommutatorSegments * gears.motor() * spindle_hz,
                                          gears.motor_mesh() * spindle_hz};
  // A hand's load changes the speed by some percent. Both bands are as wide, so that noise favours neither.
  const double reach_hz = 0.05 * lines_hz[0];
  Levels levels{.frame_s = frames.hop / rate_hz, .power = {}, .motor_and_mesh = {}};
  for_each_frame(samples, frames, [&](std::size_t, std::span<const std::complex<float>> bins) {
    auto& power = levels.power.emplace_back();
    for (std::size_t b = 0; b < kBands; ++b)
      power[b] = scale * band_energy(bins, rate_hz, kEdges_hz[b], kEdges_hz[b + 1]);
    auto& lines = levels.motor_and_mesh.emplace_back();
    // Without the motor's line nothing can be compared, and both stay 0.
    if (lines_hz[0] + reach_hz > 0.5 * rate_hz) return;
    for (std::size_t i = 0; i < 2; ++i)
      lines[i] = scale * band_energy(bins, rate_hz, lines_hz[i] - reach_hz, lines_hz[i] + reach_hz);
  });
  levels.frames = levels.power.size();
  return levels;
}

double floored_db(double power) { return std::max(kFloor_db, power_db(power)); }

// Levels in dB over the noise of each band, which is the median difference of frames that do not overlap.
std::vector<double> scaled_rows(const Levels& levels) {
  constexpr std::size_t kApart = 3;
  constexpr double kMedianOfDifferences = 0.6745 * std::numbers::sqrt2;
  std::vector<double> rows(levels.frames * kBands);
  for (std::size_t b = 0; b < kBands; ++b) {
    std::vector<double> differences;
    for (std::size_t m = 0; m < levels.frames; ++m) {
      rows[m * kBands + b] = floored_db(levels.power[m][b]);
      if (m >= kApart) differences.push_back(std::abs(rows[m * kBands + b] - rows[(m - kApart) * kBands + b]));
    }
    double noise_db = kSteadiest_db;
    if (!differences.empty()) {
      const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
      std::ranges::nth_element(differences, middle);
      noise_db = std::max(noise_db, *middle / kMedianOfDifferences);
    }
    for (std::size_t m = 0; m < levels.frames; ++m) rows[m * kBands + b] /= noise_db;
  }
  return rows;
}

struct Part {
  std::size_t first = 0, last = 0;  // frames first ... last - 1
  double seconds = 0;
  double power = 0, low_power = 0;  // mean squares of all bands, and of the first
  double level_db = 0, low_db = 0;  // the same, not below kFloor_db
  double motor_power = 0, mesh_power = 0;
  DrillingState state = DrillingState::free;

  [[nodiscard]] bool cuts() const { return state == DrillingState::cortical || state == DrillingState::cancellous; }
  [[nodiscard]] bool rests() const { return state == DrillingState::before || state == DrillingState::after; }
};

Part part_of(const Levels& levels, std::size_t first, std::size_t last) {
  Part part{.first = first, .last = last, .seconds = static_cast<double>(last - first) * levels.frame_s};
  for (std::size_t m = first; m < last; ++m) {
    for (const double power : levels.power[m]) part.power += power;
    part.low_power += levels.power[m][0];
    part.motor_power += levels.motor_and_mesh[m][0];
    part.mesh_power += levels.motor_and_mesh[m][1];
  }
  const auto frames = static_cast<double>(last - first);
  part.power /= frames, part.low_power /= frames;
  part.level_db = floored_db(part.power), part.low_db = floored_db(part.low_power);
  return part;
}

struct LevelRange {
  double low_db = 0, high_db = 0;
};

// The quietest and the loudest level of parts that last. A free drill may be heard for a moment only, but a burst is no
// reference of loudness. If no part lasts, of all that `counts` accepts.
template <class Counts>
std::optional<LevelRange> level_range(const std::vector<Part>& parts, const Counts& counts) {
  const auto extreme = [&](double shortest_s, double sign) {
    double best = -std::numeric_limits<double>::infinity();
    for (const Part& part : parts)
      if (part.seconds >= shortest_s && counts(part)) best = std::max(best, sign * part.level_db);
    return sign * best;
  };
  LevelRange range{extreme(kSustainedLow_s, -1.0), extreme(kSustainedHigh_s, 1.0)};
  if (!std::isfinite(range.low_db)) range.low_db = extreme(0.0, -1.0);
  if (!std::isfinite(range.high_db)) range.high_db = extreme(0.0, 1.0);
  if (!std::isfinite(range.low_db)) return std::nullopt;
  return range;
}

void find_rest(std::vector<Part>& parts, const StateParams& params) {
  const auto range = level_range(parts, [](const Part&) { return true; });
  const double below_db = std::max(params.silence_db, range->high_db - params.off_db);
  bool ran = false;
  for (Part& part : parts) {
    if (part.level_db >= below_db) ran = true;
    if (part.level_db < below_db) part.state = ran ? DrillingState::after : DrillingState::before;
  }
}

void find_bone(std::vector<Part>& parts, const StateParams& params, std::optional<double> free_db) {
  const auto range = level_range(parts, [](const Part& part) { return !part.rests(); });
  if (!range) return;
  const double from_db = free_db.value_or(range->low_db), span_db = range->high_db - from_db;
  if (span_db < params.distinct_db) return;
  bool several = false;
  double motor = 0, mesh = 0;
  for (Part& part : parts) {
    if (part.rests()) continue;
    const double way = (part.level_db - from_db) / span_db;
    if (way < params.free_below) continue;
    part.state = way < params.cortical_from ? DrillingState::cancellous : DrillingState::cortical;
    motor += part.motor_power, mesh += part.mesh_power;
    several = several || (part.state == DrillingState::cancellous && part.seconds >= kSustainedHigh_s);
  }
  // One kind of bone alone is the loudest, whatever it is. The first peak of cortical bone is the motor's, and that of
  // cancellous bone is the gear's (8.5.4). If the recording's rate is too low for that, the bone counts as cortical.
  if (several || motor >= mesh) return;
  for (Part& part : parts)
    if (part.state == DrillingState::cortical) part.state = DrillingState::cancellous;
}

// A short burst at low frequencies after bone, before a free or resting drill. It may be several parts. Shorter parts
// beside it are transitions, whose frames are half in the burst. While a burst rings off, it passes the level of softer
// bone: quieter parts behind it, within its longest time, are still the burst.
void find_perforation(std::vector<Part>& parts, const StateParams& params) {
  const auto is_transition = [&](std::size_t i) { return parts[i].seconds < kShortestSpan_s; };
  for (std::size_t i = 1; i < parts.size(); ++i) {
    std::size_t begin = i;
    while (begin > 0 && is_transition(begin - 1)) --begin;
    if (begin == 0 || !parts[begin - 1].cuts()) continue;
    const double burst_db = parts[begin - 1].low_db + params.burst_db;
    double seconds = 0;
    std::size_t end = i;
    while (end < parts.size() && parts[end].low_db >= burst_db && !parts[end].rests()) seconds += parts[end++].seconds;
    if (end == i || seconds > params.longest_burst_s) continue;
    const auto rings_off = [&](std::size_t k) {
      return parts[k].cuts() && parts[k].level_db < parts[k - 1].level_db &&
             seconds + parts[k].seconds <= params.longest_burst_s;
    };
    std::size_t next = end;
    while (next < parts.size() && (is_transition(next) || rings_off(next))) seconds += parts[next++].seconds;
    if (next == parts.size() || parts[next].cuts()) continue;
    for (; i < next; ++i)
      if (i < end || parts[i].cuts()) parts[i].state = DrillingState::perforation;
  }
}

std::vector<Part> merged(const Levels& levels, const std::vector<Part>& parts) {
  std::vector<Part> result;
  for (const Part& part : parts) {
    if (result.empty() || result.back().state != part.state) {
      result.push_back(part);
      continue;
    }
    const DrillingState state = part.state;
    result.back() = part_of(levels, result.back().first, part.last);
    result.back().state = state;
  }
  return result;
}

// Gives parts that are too short the state of the neighbour whose level is nearer.
void absorb_short(std::vector<Part>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Part& part = parts[i];
    if (part.seconds >= kShortestSpan_s || part.state == DrillingState::perforation) continue;
    const Part* nearest = nullptr;
    for (const Part* other : {i > 0 ? &parts[i - 1] : nullptr, i + 1 < parts.size() ? &parts[i + 1] : nullptr}) {
      if (!other || other->state == DrillingState::perforation) continue;
      if (!nearest || std::abs(other->level_db - part.level_db) < std::abs(nearest->level_db - part.level_db))
        nearest = other;
    }
    if (nearest) part.state = nearest->state;
  }
}

std::optional<double> level_of_free(const Levels& levels, const StateParams& params) {
  if (!params.free) return std::nullopt;
  const auto frame_at = [&](double s) {
    return std::min(levels.frames, static_cast<std::size_t>(std::lround(std::max(0.0, s) / levels.frame_s)));
  };
  const std::size_t first = frame_at(params.free->from_s), last = frame_at(params.free->to_s);
  if (first >= last) return std::nullopt;
  return part_of(levels, first, last).level_db;
}

}  // namespace

std::string_view name(DrillingState state) {
  constexpr std::array<std::string_view, kDrillingStates> kNames = {"before",     "free",        "cortical",
                                                                    "cancellous", "perforation", "after"};
  return kNames[static_cast<std::size_t>(state)];
}

std::vector<std::size_t> optimal_partition(std::span<const double> rows, std::size_t columns, double penalty,
                                           std::size_t shortest) {
  OSTEON_CHECK(columns > 0 && rows.size() % columns == 0 && shortest >= 1);
  const std::size_t count = rows.size() / columns;
  if (count < shortest) return count > 0 ? std::vector<std::size_t>{0} : std::vector<std::size_t>{};
  // Sums of rows 0 ... i - 1, and of their squares over all columns: the cost of a part is a difference of these.
  std::vector<double> sums((count + 1) * columns, 0.0), squares(count + 1, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    squares[i + 1] = squares[i];
    for (std::size_t c = 0; c < columns; ++c) {
      const double x = rows[i * columns + c];
      sums[(i + 1) * columns + c] = sums[i * columns + c] + x;
      squares[i + 1] += x * x;
    }
  }
  const auto cost = [&](std::size_t from, std::size_t to) {
    double means = 0;
    for (std::size_t c = 0; c < columns; ++c) {
      const double sum = sums[to * columns + c] - sums[from * columns + c];
      means += sum * sum;
    }
    return squares[to] - squares[from] - means / static_cast<double>(to - from);
  };
  // best[i]: least cost of rows 0 ... i - 1, whose last part begins at begin[i].
  std::vector<double> best(count + 1, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> begin(count + 1, 0);
  best[0] = -penalty;
  for (std::size_t to = shortest; to <= count; ++to)
    for (std::size_t from = 0; from + shortest <= to; ++from) {
      if (!std::isfinite(best[from])) continue;
      const double total = best[from] + cost(from, to) + penalty;
      if (total < best[to]) best[to] = total, begin[to] = from;
    }
  std::vector<std::size_t> firsts;
  for (std::size_t to = count; to > 0; to = begin[to]) firsts.push_back(begin[to]);
  std::ranges::reverse(firsts);
  return firsts;
}

std::vector<StateSpan> drilling_states(std::span<const float> samples, double rate_hz, const StateParams& params) {
  OSTEON_CHECK(rate_hz >= 16000 && params.frame_s > 0 && params.spindle_rpm > 0);
  const double seconds = static_cast<double>(samples.size()) / rate_hz;
  if (seconds < 0.1) return {};
  const Levels levels = levels_of(samples, rate_hz, params);
  const double penalty = kPenaltyForEachBand * (kBands + 1) * std::log(static_cast<double>(levels.frames));
  const auto firsts = optimal_partition(scaled_rows(levels), kBands, penalty, kShortestPart);
  std::vector<Part> parts;
  for (std::size_t i = 0; i < firsts.size(); ++i)
    parts.push_back(part_of(levels, firsts[i], i + 1 < firsts.size() ? firsts[i + 1] : levels.frames));

  find_rest(parts, params);
  find_bone(parts, params, level_of_free(levels, params));
  find_perforation(parts, params);
  parts = merged(levels, parts);
  absorb_short(parts);
  parts = merged(levels, parts);

  std::vector<StateSpan> spans;
  for (const Part& part : parts) {
    // Frame m has its middle at m * frame_s, so a part begins half a frame before the middle of its first one.
    const double from_s = spans.empty() ? 0.0 : (static_cast<double>(part.first) - 0.5) * levels.frame_s;
    if (!spans.empty()) spans.back().to_s = from_s;
    spans.push_back({part.state, from_s, seconds, power_db(part.power), power_db(part.low_power)});
  }
  return spans;
}

}  // namespace osteon::sound
