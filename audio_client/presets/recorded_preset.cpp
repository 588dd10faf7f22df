#include "audio_client/presets/recorded_preset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "common/sound/drilling_states.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/spectral_model.hpp"
#include "common/sound/spectrum.hpp"

namespace osteon::audio {
namespace {

using sound::amplitude_of_db;
using sound::DrillingState;

constexpr int kRate_hz = kPresetTransientRate_hz;
constexpr double kLowest_hz = 60.0, kHighest_hz = 10000.0;
// The band of the last point still ends below 9.9 kHz, which conversion to this rate passes.
constexpr double kLowestNoise_hz = 90.0, kHighestNoise_hz = 8500.0;
constexpr std::size_t kRecordedLines = 48;
constexpr double kLineRange_db = 50.0, kQuietestLine_db = -90.0;
constexpr double kSpeedReach = 0.03;                         // the speed that the user gives may be wrong by so much
constexpr double kLineReach = 0.01;                          // of a gear's line, within which a line is the gear's
constexpr double kLineWidth = 0.004;                         // of a line, on both sides of it
constexpr double kSlowest = 0.9;                             // of the free speed, in bone
constexpr double kRingRange_db = 40.0, kLeastFall_db = 1.0;  // of a mode, below the loudest, and while it rings
constexpr double kChanging_s = 0.3;
constexpr std::size_t kRing = 2048;  // samples of a part of the ringing
constexpr double kSettle_s = 0.005;  // after a blow, before its ringing is measured

template <class... Values>
std::string said(const char* format, Values... values) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::span<const float> part_of(std::span<const float> samples, const sound::StateSpan& span) {
  const auto from = std::min(samples.size(), static_cast<std::size_t>(span.from_s * kRate_hz));
  const auto to = std::min(samples.size(), static_cast<std::size_t>(span.to_s * kRate_hz));
  return samples.subspan(from, to - from);
}

// The longest span of a state, without its ends.
std::optional<sound::StateSpan> longest(const std::vector<sound::StateSpan>& states, DrillingState state) {
  std::optional<sound::StateSpan> best;
  for (const sound::StateSpan& span : states)
    if (span.state == state && (!best || span.to_s - span.from_s > best->to_s - best->from_s)) best = span;
  // At its ends the tool still changes its speed.
  if (best) {
    const double margin_s = std::min(kChanging_s, 0.25 * (best->to_s - best->from_s));
    best->from_s += margin_s;
    best->to_s -= margin_s;
  }
  return best;
}

double line_db(const sound::Spectrum& spectrum, double hz, double reach) {
  const double width = std::max(10.0, reach * hz);
  return sound::band_db(spectrum, hz - width, hz + width);
}

// The gears' lines and their sources.
struct SourceOrder {
  double order;
  LineSource source;
};

std::vector<SourceOrder> source_orders(const ToolModel& base) {
  std::vector<SourceOrder> orders;
  if (!base.geared) {
    for (int n = 1; n <= 6; ++n) {
      orders.push_back({static_cast<double>(n), LineSource::shaft});
      orders.push_back({n * base.segments * base.motor.reduction, LineSource::motor});
    }
    return orders;
  }
  for (const sound::GearLine& line : sound::gear_table(base.gears, 60.0)) {
    const bool motor_set = line.name.starts_with("motor m") || line.name.starts_with("motor spin");
    orders.push_back({line.ratio, line.name.starts_with("commutation") ? LineSource::motor
                                  : motor_set                          ? LineSource::motor_mesh
                                  : line.name.starts_with("output m") || line.name == "output spin"
                                      ? LineSource::output_mesh
                                      : LineSource::shaft});
  }
  return orders;
}

// The source whose line is nearest, or the body.
LineSource source_at(const std::vector<SourceOrder>& orders, double order) {
  LineSource source = LineSource::body;
  double nearest = kLineReach;
  for (const SourceOrder& known : orders)
    if (const double off = std::abs(order / known.order - 1.0); off < nearest) {
      nearest = off;
      source = known.source;
    }
  return source;
}

struct FoundPeak {
  double hz, level_db;  // of the amplitude
};

std::vector<FoundPeak> lines_of(std::span<const float> sines) {
  const sound::Spectrum spectrum = sound::power_spectrum(sines, kRate_hz, sines.size() >= 16384 ? 8192 : 4096);
  std::vector<FoundPeak> lines;
  for (const sound::Peak& peak : sound::strongest_peaks(spectrum, 200, 25.0)) {
    if (peak.hz < kLowest_hz || peak.hz > kHighest_hz || lines.size() == kRecordedLines) continue;
    const double level_db = line_db(spectrum, peak.hz, kLineWidth) + sound::power_db(2.0);
    const bool quiet = level_db < kQuietestLine_db || (!lines.empty() && level_db < lines[0].level_db - kLineRange_db);
    const bool beside = std::ranges::any_of(lines, [&](const FoundPeak& line) {
      return std::abs(line.hz - peak.hz) < 2.0 * std::max(10.0, kLineWidth * peak.hz);
    });
    if (!quiet && !beside) lines.push_back({peak.hz, std::min(0.0, level_db)});
  }
  return lines;
}

// The speed near the given one that puts most amplitude on lines of the gears.
double fitted_rpm(const std::vector<FoundPeak>& lines, const std::vector<SourceOrder>& orders, double rpm) {
  double best = 0, best_rpm = rpm;
  for (int step = 0; step <= 120; ++step) {
    // From the given speed outwards: of equal ones, the nearest.
    const int away = (step + 1) / 2 * (step % 2 == 0 ? 1 : -1);
    const double tried = rpm * (1.0 + kSpeedReach * away / 60.0);
    double sum = 0;
    for (const FoundPeak& line : lines)
      for (const SourceOrder& known : orders) {
        const double off = (line.hz / (tried / 60.0) / known.order - 1.0) / 0.002;
        if (std::abs(off) < 4.0) sum += amplitude_of_db(line.level_db) * std::exp(-0.5 * off * off);
      }
    if (sum > best * (1.0 + 1e-9)) {
      best = sum;
      best_rpm = tried;
    }
  }
  return best_rpm;
}

// The median of the bins round a point: lines are in few of them.
std::vector<NoisePoint> noise_of(std::span<const float> samples) {
  const sound::Spectrum spectrum = sound::power_spectrum(samples, kRate_hz);
  std::vector<NoisePoint> points;
  const double ratio = std::pow(kHighestNoise_hz / kLowestNoise_hz, 1.0 / (kMostNoisePoints - 1));
  for (std::size_t i = 0; i < kMostNoisePoints; ++i) {
    const double hz = kLowestNoise_hz * std::pow(ratio, static_cast<double>(i));
    const auto first = static_cast<std::ptrdiff_t>(hz / std::sqrt(ratio) / spectrum.bin_hz);
    const auto last = static_cast<std::ptrdiff_t>(hz * std::sqrt(ratio) / spectrum.bin_hz) + 1;
    std::vector<double> bins(spectrum.power.begin() + first, spectrum.power.begin() + last);
    const auto middle = bins.begin() + static_cast<std::ptrdiff_t>(bins.size() / 2);
    std::ranges::nth_element(bins, middle);
    points.push_back({hz, std::clamp(sound::power_db(*middle / spectrum.bin_hz), -200.0, 0.0)});
  }
  return points;
}

// Mean difference of the densities.
double difference_db(const std::vector<NoisePoint>& a, const std::vector<NoisePoint>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].db_per_hz - b[i].db_per_hz;
  return sum / static_cast<double>(a.size());
}

// By what the load has slowed the tool: the ratio at which the cut's spectrum has most at the free tool's lines.
double slowed_by(const ToolModel& model, const sound::Spectrum& cut) {
  double best = 0, best_ratio = 1;
  for (int thousandths = 1020; thousandths > 1000 * kSlowest; --thousandths) {
    const double ratio = 1e-3 * thousandths;
    double sum = 0;
    for (const Line& line : model.lines)
      if (line.teeth == 0)
        sum += amplitude_of_db(line.level_db) *
               amplitude_of_db(line_db(cut, ratio * line.order * model.rated_rpm / 60.0, 0.5 * kLineWidth));
    if (sum > best) {
      best = sum;
      best_ratio = ratio;
    }
  }
  return best_ratio;
}

// What a material changes against the free part: for each source the power of its lines, and the noise.
void learn_material(Material& material, const ToolModel& model, const sound::Spectrum& free, const sound::Spectrum& cut,
                    double noise_db) {
  const double slowed = slowed_by(model, cut);
  for (std::size_t s = 0; s < kLineSources; ++s) {
    double was = 0, is = 0;
    for (const Line& line : model.lines)
      if (static_cast<std::size_t>(line.source) == s && line.teeth == 0) {
        const double hz = line.order * model.rated_rpm / 60.0;
        was += std::pow(10.0, 0.1 * line_db(free, hz, kLineWidth));
        is += std::pow(10.0, 0.1 * line_db(cut, slowed * hz, kLineWidth));
      }
    if (was > 0) material.change_db[s] = std::clamp(applied_change(sound::power_db(is / was)), -60.0, 60.0);
  }
  material.noise_db = std::clamp(applied_change(noise_db), -60.0, 60.0);
}

Result<RecordedPreset> turning(std::span<const float> x, const ToolModel& base, const RecordedParams& params,
                               const KeepGoing& keep_going) {
  RecordedPreset made{.model = base, .text = {}};
  ToolModel& model = made.model;
  const double rpm = params.rpm > 0 ? params.rpm : base.rated_rpm;
  const auto states = sound::drilling_states(x, kRate_hz, {.spindle_rpm = std::min(rpm, 2745.0), .free = {}});
  auto free = longest(states, DrillingState::free);
  if (!free)
    for (const auto state : {DrillingState::cancellous, DrillingState::cortical})
      if (!free) free = longest(states, state);
  if (!free || free->to_s - free->from_s < 0.1)
    return bad_input(
        "no tool runs in the recording for 0.1 s or more; choose a part by --from and --to, or record "
        "nearer to the tool");
  sound::SpectralParams spectral;
  spectral.partials.peaks.refinements = params.refinements;
  const auto analysed = sound::spectral_analysis(x, kRate_hz, spectral, keep_going);
  if (!analysed) return tl::unexpected(analysed.error());
  const sound::SpectralAnalysis& analysis = *analysed;
  const std::vector<FoundPeak> found = lines_of(part_of(analysis.kept_sines, *free));
  const std::vector<SourceOrder> orders = source_orders(base);
  model.rated_rpm = base.geared ? fitted_rpm(found, orders, rpm) : rpm;
  made.text += said("reference  %s, %.2f to %.2f s, %.0f a minute\n", std::string(sound::name(free->state)).c_str(),
                    free->from_s, free->to_s, model.rated_rpm);
  model.lines.clear();
  for (const FoundPeak& line : found) {
    const double order = line.hz * 60.0 / model.rated_rpm;
    if (order >= 0.001 && order <= 10000.0)
      model.lines.push_back(
          {.order = order, .teeth = 0, .source = source_at(orders, order), .level_db = line.level_db});
  }
  std::size_t known = 0;
  for (const Line& line : model.lines) known += line.source == LineSource::body ? 0 : 1;
  made.text += said("lines      %zu, and %zu of them of a known source\n", model.lines.size(), known);
  for (const Line& line : base.lines)  // heard only in bone, so they are not in the free part
    if (line.source == LineSource::teeth && model.lines.size() < kMostLines) model.lines.push_back(line);
  model.noise = noise_of(part_of(x, *free));
  made.text += said("noise      %zu points, %.0f to %.0f Hz\n", model.noise.size(), model.noise.front().hz,
                    model.noise.back().hz);
  for (auto [state, material] :
       {std::pair{DrillingState::cancellous, &model.cancellous}, std::pair{DrillingState::cortical, &model.cortical}}) {
    const auto cut = longest(states, state);
    if (!cut || cut->from_s == free->from_s || cut->to_s - cut->from_s < 0.1) continue;
    learn_material(*material, model, sound::power_spectrum(part_of(x, *free), kRate_hz),
                   sound::power_spectrum(part_of(x, *cut), kRate_hz),
                   difference_db(noise_of(part_of(x, *cut)), model.noise));
    made.text += said("%-10s %.2f to %.2f s\n", std::string(sound::name(state)).c_str(), cut->from_s, cut->to_s);
  }
  return made;
}

// The power of the ringing, summed over the blows that have room for it: just after them, and one window later. Returns
// how many they are.
int ringing_of(std::span<const float> x, const std::vector<std::size_t>& impacts, sound::Spectrum& early,
               sound::Spectrum& late) {
  int blows = 0;
  for (std::size_t i = 0; i < impacts.size(); ++i) {
    const std::size_t begin = impacts[i] + static_cast<std::size_t>(kSettle_s * kRate_hz);
    const std::size_t end = i + 1 < impacts.size() ? impacts[i + 1] : x.size();
    if (begin + 2 * kRing > end) continue;
    ++blows;
    for (auto [sum, at] : {std::pair{&early, begin}, std::pair{&late, begin + kRing}}) {
      const sound::Spectrum one = sound::power_spectrum(x.subspan(at, kRing), kRate_hz, kRing);
      if (sum->power.empty()) *sum = {one.bin_hz, std::vector<double>(one.power.size(), 0.0)};
      for (std::size_t k = 0; k < one.power.size(); ++k) sum->power[k] += one.power[k];
    }
  }
  return blows;
}

Result<RecordedPreset> struck(std::span<const float> x, const ToolModel& base, const RecordedParams& params,
                              const KeepGoing& keep_going) {
  RecordedPreset made{.model = base, .text = {}};
  sound::SpectralParams spectral;
  spectral.partials.peaks.refinements = params.refinements;
  const auto analysed = sound::spectral_analysis(x, kRate_hz, spectral, keep_going);
  if (!analysed) return tl::unexpected(analysed.error());
  const sound::SpectralAnalysis& analysis = *analysed;
  sound::Spectrum early, late;
  const int blows = ringing_of(x, analysis.impacts, early, late);
  if (blows == 0)
    return bad_input(
        "no blow is in the recording that rings for 0.2 s before the next; choose a part by --from and "
        "--to, or give --tool a tool that turns");
  BlowParams& blow = made.model.blow;
  blow.modes.clear();
  blow.contact_s = 1e-5;  // the levels are those that were heard, with the contact's own spectrum
  const double window_s = static_cast<double>(kRing) / kRate_hz;
  double loudest_db = sound::kSilence_db;
  for (const sound::Peak& peak : sound::strongest_peaks(early, static_cast<int>(kMostModes), 60.0)) {
    loudest_db = std::max(loudest_db, peak.level_db);
    const double fall_db = line_db(early, peak.hz, 0.0) - line_db(late, peak.hz, 0.0);
    const bool rings = peak.level_db > loudest_db - kRingRange_db && fall_db > kLeastFall_db;
    if (!rings || peak.hz < kLowest_hz || peak.hz > kHighest_hz) continue;
    const double decay_s = std::clamp(8.685889638 * window_s / fall_db, 0.003, 1.0);
    // The window's middle is half a window after its begin; so much louder was the mode then.
    const double then_db = std::min(30.0, 8.685889638 * (kSettle_s + 0.5 * window_s) / decay_s);
    blow.modes.push_back({peak.hz, decay_s, std::min(0.0, peak.level_db + sound::power_db(2.0 / blows) + then_db)});
  }
  made.text += said("blows      %zu\nmodes      %zu\n", analysis.impacts.size(), blow.modes.size());
  if (blow.modes.empty())
    made.text +=
        "note       nothing rings after the blows, so the preset has little to sound; is it the right --tool?\n";
  for (const sound::Transient& transient : analysis.model.transients)
    if (made.model.transients.size() < kMostTransients) made.model.transients.push_back(transient.samples);
  if (!made.model.transients.empty()) blow.click_db = 0.0;  // as recorded
  return made;
}

}  // namespace

Result<RecordedPreset> recorded_preset(std::span<const float> samples, int rate_hz, const ToolModel& base,
                                       const RecordedParams& params, const KeepGoing& keep_going) {
  const std::vector<float> x = sound::resampled(samples, rate_hz, kRate_hz);
  ToolModel start = base;
  start.name = params.name;
  start.title = params.name + ", from a recording";
  if (!params.tools.empty()) start.tools = params.tools;
  start.recorded_s = static_cast<double>(x.size()) / kRate_hz;
  start.transients.clear();
  auto made = base.drive == Drive::blows ? struck(x, start, params, keep_going) : turning(x, start, params, keep_going);
  if (!made) return made;
  std::size_t stored = 0;
  for (const std::vector<float>& transient : made->model.transients) stored += transient.size();
  made->text += said("samples    %zu impacts, %.1f %% of the recording\n", made->model.transients.size(),
                     x.empty() ? 0.0 : 100.0 * static_cast<double>(stored) / static_cast<double>(x.size()));
  return made;
}

}  // namespace osteon::audio
