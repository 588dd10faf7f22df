#include "audio_client/analysis/analysis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>

#include "audio_client/analysis/recording_notes.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/spectral_subtraction.hpp"

namespace osteon::audio {
namespace {

constexpr int kPeaks = 8;
constexpr double kPeaksApart_hz = 60;
constexpr double kStandsOut_db = 8;
// Columns of a spectrogram. More are neither seen in a picture nor read in a table.
constexpr std::size_t kMostColumns = 2000;

std::span<const float> part_of(const std::vector<float>& samples, const sound::TimeSpan& span, double rate_hz) {
  const auto at = [&](double s) {
    return static_cast<std::size_t>(std::clamp(s * rate_hz, 0.0, static_cast<double>(samples.size())));
  };
  return std::span(samples).subspan(at(span.from_s), at(span.to_s) - at(span.from_s));
}

std::optional<sound::TimeSpan> longest(const std::vector<sound::StateSpan>& states, sound::DrillingState state) {
  std::optional<sound::TimeSpan> best;
  for (const sound::StateSpan& span : states)
    if (span.state == state && (!best || span.to_s - span.from_s > best->to_s - best->from_s))
      best = sound::TimeSpan{span.from_s, span.to_s};
  return best;
}

// The level that five bins of the neighbourhood have, as many as the level of a peak has. It is their median: other
// lines in the neighbourhood, such as sidebands, do not raise it. The line's own main lobe is left out.
double around_db(const sound::Spectrum& spectrum, double hz) {
  constexpr std::ptrdiff_t kNearest = 4, kFurthest = 20;  // bins
  const auto middle = static_cast<std::ptrdiff_t>(std::lround(hz / spectrum.bin_hz));
  std::vector<double> around;
  for (std::ptrdiff_t k = middle - kFurthest; k <= middle + kFurthest; ++k)
    if (k > 0 && k < std::ssize(spectrum.power) && std::abs(k - middle) >= kNearest)
      around.push_back(spectrum.power[static_cast<std::size_t>(k)]);
  const auto half = around.begin() + std::ssize(around) / 2;
  std::ranges::nth_element(around, half);
  return sound::power_db(5.0 * *half);
}

std::vector<FoundLine> find_lines(const SoundAnalysis& a) {
  const StateSpectrum* free = spectrum_of(a, sound::DrillingState::free);
  // In less than a window, lines are too wide to be told from noise.
  const bool lasts = free && (free->span.to_s - free->span.from_s) * a.rate_hz >= a.params.spectrum_window;
  const sound::Spectrum& spectrum = lasts ? free->spectrum : a.whole;
  const std::vector<sound::Peak> peaks = sound::strongest_peaks(spectrum, 400, 2 * spectrum.bin_hz);
  std::vector<FoundLine> found;
  for (const sound::GearLine& line : sound::gear_table(sound::Gearbox{}, a.params.spindle_rpm)) {
    found.push_back({line, {}});
    const double reach_hz = std::max(a.params.line_reach * line.hz, 2 * spectrum.bin_hz);
    const auto peak =
        std::ranges::find_if(peaks, [&](const sound::Peak& heard) { return std::abs(heard.hz - line.hz) <= reach_hz; });
    if (peak == peaks.end()) continue;
    if (peak->level_db > around_db(spectrum, peak->hz) + kStandsOut_db) found.back().peak = *peak;
  }
  return found;
}

std::optional<Difference> difference_of(const SoundAnalysis& a) {
  std::optional<sound::TimeSpan> free = a.params.free;
  if (!free) free = longest(a.states, sound::DrillingState::free);
  const StateSpectrum* drilled = spectrum_of(a, sound::DrillingState::cortical);
  if (!drilled) drilled = spectrum_of(a, sound::DrillingState::cancellous);
  if (!free || !drilled) return std::nullopt;

  const sound::Stft transform = sound::stft(a.samples, a.rate_hz, {});
  const auto frame_at = [&](double s) { return s * a.rate_hz / transform.params.hop; };
  const auto whole = [&](double frame) {
    return static_cast<std::size_t>(std::clamp(frame, 0.0, static_cast<double>(transform.frames)));
  };
  // The frames that lie within the span with both halves, each as long as a hop.
  const std::size_t first = whole(std::ceil(frame_at(free->from_s)) + 1.0),
                    last = whole(std::floor(frame_at(free->to_s)));
  if (first >= last) return std::nullopt;
  const sound::StationarySpectrum stationary = sound::stationary_spectrum(transform, first, last);
  Difference difference{.free = *free,
                        .samples = sound::inverse_stft(sound::spectral_subtraction(transform, stationary)),
                        .spectrum = {},
                        .drilled = drilled->state};
  difference.spectrum =
      sound::power_spectrum(part_of(difference.samples, drilled->span, a.rate_hz), a.rate_hz, a.params.spectrum_window);
  return difference;
}

void add_spectra(SoundAnalysis& a) {
  for (int i = 0; i < sound::kDrillingStates; ++i) {
    const auto state = static_cast<sound::DrillingState>(i);
    const auto span = longest(a.states, state);
    if (!span) continue;
    StateSpectrum of{.state = state, .span = *span, .spectrum = {}, .peaks = {}};
    of.spectrum = sound::power_spectrum(part_of(a.samples, *span, a.rate_hz), a.rate_hz, a.params.spectrum_window);
    of.peaks = sound::strongest_peaks(of.spectrum, kPeaks, kPeaksApart_hz);
    a.spectra.push_back(std::move(of));
  }
}

void add_packets(SoundAnalysis& a) {
  const sound::WaveletPackets packets = sound::wavelet_packets(a.samples, a.rate_hz);
  for (int level = 1; level <= sound::kMostLevels; ++level) {
    const std::vector<double> shares = sound::energy_shares(packets, level);
    for (int index = 0; index < 1 << level; ++index) {
      const double share = shares[static_cast<std::size_t>(index)];
      const double level_db = std::max(sound::kSilence_db, a.level_db + sound::power_db(share));
      a.packets.push_back({{level, index}, share, level_db});
    }
  }
  for (const sound::Packet& packet : sound::drilling_bands())
    a.bands.push_back({packet, sound::band_signal(packets, packet)});
}

}  // namespace

const StateSpectrum* spectrum_of(const SoundAnalysis& analysis, sound::DrillingState state) {
  const auto found = std::ranges::find(analysis.spectra, state, &StateSpectrum::state);
  return found == analysis.spectra.end() ? nullptr : &*found;
}

SoundAnalysis analyse(const sound::WavSound& recording, const AnalysisParams& params) {
  return *analyse(recording, params, [](double) { return true; });
}

Result<SoundAnalysis> analyse(const sound::WavSound& recording, const AnalysisParams& params,
                              const KeepGoing& keep_going) {
  SoundAnalysis a;
  a.params = params;
  a.file_rate_hz = recording.rate_hz, a.file_channels = recording.channels, a.file_bits = recording.bits;
  a.file_floating = recording.floating, a.announced_s = recording.announced_s;
  a.from_s = recording.from_s, a.file_s = recording.file_s;
  a.clipped = recording.clipped, a.file_notes = recording_notes(recording);
  const std::function<void()> parts[] = {
      [&] {
        a.samples = sound::resampled(recording.samples, recording.rate_hz, a.rate_hz);
        a.level_db = sound::rms_db(a.samples);
        a.peak = sound::peak(recording.samples);
      },
      [&] {
        a.whole = sound::power_spectrum(a.samples, a.rate_hz, params.spectrum_window);
        a.spectrogram = sound::spectrogram(a.samples, a.rate_hz, params.spectrogram_window, kMostColumns);
      },
      [&] {
        a.states =
            sound::drilling_states(a.samples, a.rate_hz, {.spindle_rpm = params.spindle_rpm, .free = params.free});
      },
      [&] { add_spectra(a); },
      [&] { add_packets(a); },
      [&] { a.lines = find_lines(a); },
      [&] { a.difference = difference_of(a); },
  };
  double done = 0;
  for (const std::function<void()>& each : parts) {
    each();
    if (!keep_going(++done / static_cast<double>(std::size(parts)))) return stopped_while("analysing the recording");
  }
  return a;
}

}  // namespace osteon::audio
