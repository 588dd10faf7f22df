#include "audio_client/analysis/analysis_plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string_view>

#include "audio_client/analysis/plot.hpp"
#include "common/sound/levels.hpp"

namespace osteon::audio {
namespace {

using picture::Colour;
using picture::Picture;
using sound::DrillingState;

constexpr int kWidth = 1100, kLeft = 64, kRight = 16, kPlotWidth = kWidth - kLeft - kRight;
constexpr Colour kSignal{74, 111, 165}, kAccent{200, 85, 61}, kBone{176, 141, 87};
constexpr Colour kLineInk{120, 90, 40};

// Okabe and Ito's colours, which people with impaired colour vision tell apart (Okabe 2008).
constexpr std::array<Colour, sound::kDrillingStates> kStateColours = {
    {{153, 153, 153}, {0, 114, 178}, {213, 94, 0}, {230, 159, 0}, {204, 121, 167}, {0, 158, 115}}};

std::string hertz(double from_hz, double to_hz) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.0f-%.0f Hz", from_hz, to_hz);
  return text.data();
}

Axis time_axis(const SoundAnalysis& a) { return {0.0, static_cast<double>(a.samples.size()) / a.rate_hz, "time, s"}; }

void mark_states(Plot& plot, const SoundAnalysis& a, const Axis& vertical) {
  for (const sound::StateSpan& span : a.states)
    plot.bar(span.from_s, span.to_s, vertical.low, vertical.high, picture::mixed(kPaper, colour_of(span.state), 0.18));
}

// `ink`: of all names; without it, each has the colour of its state.
void name_states(Plot& plot, const SoundAnalysis& a, std::optional<Colour> ink = std::nullopt) {
  for (const sound::StateSpan& span : a.states) plot.vertical_line(span.from_s, ink.value_or(colour_of(span.state)));
  // Names of short spans would lie on each other: each takes the first line that is free there. Where none is, as in a
  // recording of hundreds of spans, the colour tells the state.
  constexpr int kLines = 8, kLineHeight = 10, kGap = 4;
  std::array<int, kLines> taken_to{};
  for (const sound::StateSpan& span : a.states) {
    const std::string_view name = sound::name(span.state);
    const int from = plot.note_column(span.from_s, name);
    const auto line = std::ranges::find_if(taken_to, [&](int to) { return to <= from; });
    if (line == taken_to.end()) continue;
    *line = from + picture::text_width(name) + kGap;
    plot.note(span.from_s, 3 + kLineHeight * static_cast<int>(line - taken_to.begin()), name,
              ink.value_or(colour_of(span.state)));
  }
}

// A little more than the largest magnitude, so that curves do not touch the frame. Silence has an axis too.
double reach_of(std::span<const float> samples) { return std::max(1e-4, 1.05 * sound::peak(samples)); }

NamedPicture waveform(const SoundAnalysis& a) {
  Picture page(kWidth, 300, kPaper);
  const double reach = reach_of(a.samples);
  const Axis vertical{-reach, reach, "amplitude, full scale = 1"};
  Plot plot(page, {kLeft, 24, kPlotWidth, 226}, time_axis(a), vertical);
  mark_states(plot, a, vertical);
  plot.samples(a.samples, a.rate_hz, kSignal);
  name_states(plot, a);
  return {"waveform.png", std::move(page)};
}

struct Curve {
  std::vector<double> hz, db;
};

Curve density_curve(const sound::Spectrum& spectrum) {
  Curve curve;
  for (std::size_t k = 1; k < spectrum.power.size(); ++k) {
    curve.hz.push_back(static_cast<double>(k) * spectrum.bin_hz);
    curve.db.push_back(sound::density_db(spectrum, k));
  }
  return curve;
}

// From the loudest density to 90 dB below it, as far as there is something.
Axis density_axis(const std::vector<const sound::Spectrum*>& spectra) {
  double high = sound::kSilence_db, low = 0;
  for (const sound::Spectrum* spectrum : spectra)
    for (const double db : density_curve(*spectrum).db) high = std::max(high, db), low = std::min(low, db);
  high = 10.0 * std::ceil(0.1 * (high + 1.0));
  return {std::max(10.0 * std::floor(0.1 * low), high - 90.0), high, "density, dB re full scale/Hz"};
}

void draw_density(Plot& plot, const sound::Spectrum& spectrum, Colour colour, std::string_view name, int line) {
  const Curve curve = density_curve(spectrum);
  plot.curve(curve.hz, curve.db, colour);
  plot.note(0.78 * curve.hz.back(), 4 + 11 * line, name, colour);
}

NamedPicture density(const SoundAnalysis& a) {
  Picture page(kWidth, 420, kPaper);
  std::vector<const sound::Spectrum*> spectra{&a.whole};
  for (const StateSpectrum& of : a.spectra) spectra.push_back(&of.spectrum);
  const Axis vertical = density_axis(spectra);
  Plot plot(page, {kLeft, 24, kPlotWidth, 346}, {0.0, 0.5 * a.rate_hz, "frequency, Hz"}, vertical);
  for (const FoundLine& line : a.lines)
    if (line.line.hz < 0.5 * a.rate_hz) plot.vertical_line(line.line.hz, picture::mixed(kPaper, kBone, 0.6));
  int line = 0;
  draw_density(plot, a.whole, kWholeColour, "whole", line++);
  for (const StateSpectrum& of : a.spectra)
    draw_density(plot, of.spectrum, colour_of(of.state), sound::name(of.state), line++);
  // Below 900 Hz the names would lie on each other.
  int named = 0;
  for (const FoundLine& found : a.lines)
    if (found.line.hz > 900 && found.line.hz < 0.5 * a.rate_hz)
      plot.note(found.line.hz, 4 + 11 * (named++ % 8), found.line.name, kLineInk);
  return {"psd.png", std::move(page)};
}

NamedPicture spectrogram(const SoundAnalysis& a) {
  constexpr double kRange_db = 80;
  Picture page(kWidth, 420, kPaper);
  const sound::Spectrogram& s = a.spectrogram;
  // Silence stays dark: it is not the warmest only because nothing is louder.
  constexpr double kQuietest_db = -75;
  const double loudest_db = std::max(kQuietest_db, sound::power_db(*std::ranges::max_element(s.power)));
  Plot plot(page, {kLeft, 24, kPlotWidth, 346}, time_axis(a), {0.0, 0.5 * a.rate_hz, "frequency, Hz"});
  plot.map([&](double x, double y) {
    const auto column = std::min(s.columns - 1, static_cast<std::size_t>(x / s.column_s));
    const auto bin = std::min(s.bins - 1, static_cast<std::size_t>(std::lround(y / s.bin_hz)));
    return heat(1.0 + (sound::power_db(s.at(column, bin)) - loudest_db) / kRange_db);
  });
  name_states(plot, a, kPaper);
  std::array<char, 96> scale{};
  std::snprintf(scale.data(), scale.size(), "dark: %.0f dB, light: %.0f dB re full scale, each bin of %.0f Hz",
                loudest_db - kRange_db, loudest_db, s.bin_hz);
  page.text(kLeft + 160, 8, scale.data(), kInk);
  return {"spectrogram.png", std::move(page)};
}

// Energy of the bands of each level, as in Figure 8.12.
NamedPicture packets(const SoundAnalysis& a) {
  constexpr int kHeight = 96, kStep = 150;
  Picture page(kWidth, 24 + sound::kMostLevels * kStep, kPaper);
  for (int level = 1; level <= sound::kMostLevels; ++level) {
    Plot plot(page, {kLeft, 24 + (level - 1) * kStep, kPlotWidth, kHeight}, {0.0, 0.5 * a.rate_hz, "frequency, Hz"},
              {0.0, 1.0, "level " + std::to_string(level) + ": part of the energy"});
    for (const PacketShare& of : a.packets) {
      if (of.packet.level != level) continue;
      const sound::Band band = sound::packet_band(of.packet, a.rate_hz);
      const double gap_hz = 0.06 * (band.to_hz - band.from_hz);
      plot.bar(band.from_hz + gap_hz, band.to_hz - gap_hz, 0.0, of.share, kSignal);
      if (level <= 4) plot.note(band.from_hz, 2, sound::packet_name(of.packet), kInk);
    }
  }
  return {"packets.png", std::move(page)};
}

// The displacement in the part of the axis that the recording has.
Axis displacement_axis(std::span<const DisplacementRow> rows) {
  const auto [low, high] = std::ranges::minmax(rows, {}, &DisplacementRow::mm);
  const double margin = std::max(0.5, 0.05 * (high.mm - low.mm));
  return {low.mm - margin, high.mm + margin, "displacement, mm"};
}

NamedPicture bands(const SoundAnalysis& a, std::span<const DisplacementRow> displacement) {
  constexpr int kHeight = 84, kStep = 134;
  // With the displacement, each band has a second axis.
  const int width = kPlotWidth - (displacement.empty() ? 0 : Plot::kRightAxis - kRight);
  const int panels = static_cast<int>(a.bands.size()) + (displacement.empty() ? 0 : 1);
  Picture page(kWidth, 24 + panels * kStep, kPaper);
  std::vector<double> time_s, mm;
  for (const DisplacementRow& row : displacement) time_s.push_back(row.time_s), mm.push_back(row.mm);
  int y = 24;
  if (!displacement.empty()) {
    const Axis vertical = displacement_axis(displacement);
    Plot plot(page, {kLeft, y, width, kHeight}, time_axis(a), vertical);
    mark_states(plot, a, vertical);
    plot.curve(time_s, mm, kAccent);
    name_states(plot, a);
    y += kStep;
  }
  for (const BandInTime& of : a.bands) {
    const sound::Band band = sound::packet_band(of.packet, a.rate_hz);
    const double reach = reach_of(of.samples);
    const Axis vertical{
        -reach, reach,
        sound::packet_name(of.packet) + ", " + hertz(band.from_hz, band.to_hz) + ": amplitude, full scale = 1"};
    Plot plot(page, {kLeft, y, width, kHeight}, time_axis(a), vertical);
    mark_states(plot, a, vertical);
    plot.samples(of.samples, a.rate_hz, kSignal);
    if (!displacement.empty()) {
      const Axis own = displacement_axis(displacement);
      std::vector<double> scaled(mm.size());
      std::ranges::transform(mm, scaled.begin(), [&](double at) {
        return vertical.low + (vertical.high - vertical.low) * (at - own.low) / (own.high - own.low);
      });
      plot.curve(time_s, scaled, kAccent);
      plot.right_axis(own, kAccent);
    }
    y += kStep;
  }
  return {"bands.png", std::move(page)};
}

NamedPicture difference(const SoundAnalysis& a) {
  Picture page(kWidth, 700, kPaper);
  const Difference& d = *a.difference;
  const StateSpectrum* drilled = spectrum_of(a, d.drilled);
  const StateSpectrum* free = spectrum_of(a, DrillingState::free);
  std::vector<const sound::Spectrum*> spectra{&drilled->spectrum, &d.spectrum};
  if (free) spectra.push_back(&free->spectrum);
  Plot above(page, {kLeft, 24, kPlotWidth, 346}, {0.0, 0.5 * a.rate_hz, "frequency, Hz"}, density_axis(spectra));
  draw_density(above, drilled->spectrum, colour_of(d.drilled), sound::name(d.drilled), 0);
  if (free) draw_density(above, free->spectrum, colour_of(DrillingState::free), "free", 1);
  draw_density(above, d.spectrum, kInk, "difference", 2);
  const double reach = reach_of(d.samples);
  const Axis vertical{-reach, reach, "difference, full scale = 1"};
  Plot below(page, {kLeft, 440, kPlotWidth, 206}, time_axis(a), vertical);
  mark_states(below, a, vertical);
  below.samples(d.samples, a.rate_hz, kSignal);
  name_states(below, a);
  return {"difference.png", std::move(page)};
}

}  // namespace

Colour colour_of(DrillingState state) { return kStateColours[static_cast<std::size_t>(state)]; }

std::vector<NamedPicture> pictures_of(const SoundAnalysis& analysis, std::span<const DisplacementRow> displacement) {
  std::vector<NamedPicture> pictures;
  pictures.push_back(waveform(analysis));
  pictures.push_back(density(analysis));
  pictures.push_back(spectrogram(analysis));
  pictures.push_back(packets(analysis));
  pictures.push_back(bands(analysis, displacement));
  if (analysis.difference) pictures.push_back(difference(analysis));
  return pictures;
}

}  // namespace osteon::audio
