#include "audio_client/analysis/analysis_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "audio_client/analysis/analysis_plots.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/new_folder.hpp"
#include "common/sound/levels.hpp"

namespace osteon::audio {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kBlock_s = 0.01;  // of levels over time

__attribute__((format(printf, 1, 2))) std::string formatted(const char* format, ...) {
  char text[256];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  return text;
}

// Further digits say nothing, and may depend on the machine.
double rounded(double value, double parts = 1e3) { return std::round(value * parts) / parts; }

double seconds_of(const SoundAnalysis& a) { return static_cast<double>(a.samples.size()) / a.rate_hz; }

std::string channels_text(int channels) {
  return channels == 1 ? "mono" : channels == 2 ? "stereo" : std::to_string(channels) + " channels";
}

// What the user should know of the recording, a line each.
std::string notes_of(const SoundAnalysis& a) {
  std::string text = a.file_notes;
  const auto silent = [](const sound::StateSpan& span) { return span.state == sound::DrillingState::before; };
  if (std::ranges::all_of(a.states, silent))
    text += std::string("note       no drill was heard") +
            (a.file_channels > 1 ? "; is it the right --channel?\n" : "; is it the right recording?\n");
  return text;
}

json level_json(const SoundAnalysis& a, double level_db) {
  json level = {{"db_full_scale", rounded(level_db)}};
  if (a.params.full_scale_pa) level["db_spl"] = rounded(sound::sound_level_db(level_db, *a.params.full_scale_pa));
  return level;
}

json spectra_json(const SoundAnalysis& a) {
  json spectra = json::array();
  for (const StateSpectrum& of : a.spectra) {
    json peaks = json::array();
    for (const sound::Peak& peak : of.peaks)
      peaks.push_back({{"hz", rounded(peak.hz)}, {"level", level_json(a, peak.level_db)}});
    spectra.push_back({{"state", sound::name(of.state)},
                       {"from_s", rounded(of.span.from_s)},
                       {"to_s", rounded(of.span.to_s)},
                       {"level", level_json(a, sound::band_db(of.spectrum, 0.0, a.rate_hz))},
                       {"centroid_hz", rounded(sound::centroid_hz(of.spectrum, 20.0, a.rate_hz))},
                       {"peaks", peaks}});
  }
  return spectra;
}

json packets_json(const SoundAnalysis& a) {
  json packets = json::array();
  for (const PacketShare& of : a.packets) {
    const sound::Band band = sound::packet_band(of.packet, a.rate_hz);
    packets.push_back({{"level", of.packet.level},
                       {"band", of.packet.index},
                       {"name", sound::packet_name(of.packet)},
                       {"from_hz", rounded(band.from_hz)},
                       {"to_hz", rounded(band.to_hz)},
                       {"energy_share", rounded(of.share, 1e6)},
                       {"rms", level_json(a, of.level_db)}});
  }
  return packets;
}

json lines_json(const SoundAnalysis& a) {
  json lines = json::array();
  for (const FoundLine& of : a.lines) {
    lines.push_back({{"name", of.line.name}, {"ratio", rounded(of.line.ratio)}, {"hz", rounded(of.line.hz)}});
    if (of.peak) lines.back()["found"] = {{"hz", rounded(of.peak->hz)}, {"level", level_json(a, of.peak->level_db)}};
  }
  return lines;
}

std::string density_table(const SoundAnalysis& a) {
  std::string text = "frequency_hz,whole_db_per_hz";
  for (const StateSpectrum& of : a.spectra) text += "," + std::string(sound::name(of.state)) + "_db_per_hz";
  text += a.difference ? ",difference_db_per_hz\n" : "\n";
  for (std::size_t k = 0; k < a.whole.power.size(); ++k) {
    text += formatted("%.3f,%.3f", static_cast<double>(k) * a.whole.bin_hz, sound::density_db(a.whole, k));
    for (const StateSpectrum& of : a.spectra) text += formatted(",%.3f", sound::density_db(of.spectrum, k));
    text += a.difference ? formatted(",%.3f\n", sound::density_db(a.difference->spectrum, k)) : "\n";
  }
  return text;
}

// A row for each moment, a column for each frequency.
std::string spectrogram_table(const SoundAnalysis& a) {
  const sound::Spectrogram& s = a.spectrogram;
  std::string text = "time_s";
  for (std::size_t k = 0; k < s.bins; ++k) text += formatted(",%.1f_hz", static_cast<double>(k) * s.bin_hz);
  text += "\n";
  for (std::size_t c = 0; c < s.columns; ++c) {
    text += formatted("%.4f", static_cast<double>(c) * s.column_s);
    for (std::size_t k = 0; k < s.bins; ++k) text += formatted(",%.1f", sound::power_db(s.at(c, k)));
    text += "\n";
  }
  return text;
}

std::string packet_table(const SoundAnalysis& a) {
  std::string text = "level,band,name,from_hz,to_hz,energy_share,rms_db\n";
  for (const PacketShare& of : a.packets) {
    const sound::Band band = sound::packet_band(of.packet, a.rate_hz);
    text += formatted("%d,%d,%s,%.3f,%.3f,%.6f,%.3f\n", of.packet.level, of.packet.index,
                      sound::packet_name(of.packet).c_str(), band.from_hz, band.to_hz, of.share, of.level_db);
  }
  return text;
}

std::string state_table(const SoundAnalysis& a) {
  std::string text = "state,from_s,to_s,level_db,low_db\n";
  for (const sound::StateSpan& span : a.states)
    text += formatted("%s,%.3f,%.3f,%.3f,%.3f\n", std::string(sound::name(span.state)).c_str(), span.from_s, span.to_s,
                      span.level_db, span.low_db);
  return text;
}

std::string gear_table_text(const SoundAnalysis& a) {
  std::string text = "name,ratio,hz,found_hz,found_level_db\n";
  for (const FoundLine& of : a.lines) {
    text += formatted("%s,%.4f,%.3f,", std::string(of.line.name).c_str(), of.line.ratio, of.line.hz);
    text += of.peak ? formatted("%.3f,%.3f\n", of.peak->hz, of.peak->level_db) : ",\n";
  }
  return text;
}

// Linear between rows, and that of the first and the last beyond them.
double displacement_at(std::span<const DisplacementRow> rows, double time_s) {
  const auto after = std::ranges::upper_bound(rows, time_s, {}, &DisplacementRow::time_s);
  if (after == rows.begin()) return rows.front().mm;
  if (after == rows.end()) return rows.back().mm;
  const DisplacementRow &from = *(after - 1), &to = *after;
  const double part = (time_s - from.time_s) / (to.time_s - from.time_s);
  return from.mm + part * (to.mm - from.mm);
}

std::string band_table(const SoundAnalysis& a, std::span<const DisplacementRow> displacement) {
  const auto block = static_cast<std::size_t>(std::lround(kBlock_s * a.rate_hz));
  std::string text = displacement.empty() ? "time_s,whole_db" : "time_s,displacement_mm,whole_db";
  std::vector<std::vector<double>> levels{sound::block_levels_db(a.samples, block)};
  for (const BandInTime& of : a.bands) {
    text += "," + sound::packet_name(of.packet) + "_db";
    levels.push_back(sound::block_levels_db(of.samples, block));
  }
  text += "\n";
  for (std::size_t i = 0; i < levels.front().size(); ++i) {
    const double time_s = (static_cast<double>(i) + 0.5) * static_cast<double>(block) / a.rate_hz;
    text += formatted("%.4f", time_s);
    if (!displacement.empty()) text += formatted(",%.4f", displacement_at(displacement, time_s));
    for (const std::vector<double>& band : levels) text += formatted(",%.2f", band[i]);
    text += "\n";
  }
  return text;
}

}  // namespace

std::string to_text(const SoundAnalysis& a) {
  const double seconds = seconds_of(a);
  std::string text =
      formatted("recording  %.3f s, %d Hz, %d bits%s, %s; analysed at %.0f Hz\n", seconds, a.file_rate_hz, a.file_bits,
                a.file_floating ? " float" : "", channels_text(a.file_channels).c_str(), a.rate_hz);
  if (a.from_s > 0 || a.file_s > seconds + 0.001)
    text += formatted("part       from %.3f s of %.3f s; all times count from there\n", a.from_s, a.file_s);
  text += notes_of(a);
  text += formatted("level      %.1f dB re full scale", a.level_db);
  if (a.params.full_scale_pa)
    text += formatted(", %.1f dB re 20 uPa", sound::sound_level_db(a.level_db, *a.params.full_scale_pa));
  text += formatted(", peak %.3f\n\n", a.peak);
  text += "state           from s      to s     level dB\n";
  for (const sound::StateSpan& span : a.states)
    text += formatted("%-12s %9.3f %9.3f %12.1f\n", std::string(sound::name(span.state)).c_str(), span.from_s,
                      span.to_s, span.level_db);
  text += formatted("\nline at %.0f rpm      Hz   found Hz     level dB\n", a.params.spindle_rpm);
  for (const FoundLine& of : a.lines) {
    text += formatted("%-16s %9.2f ", std::string(of.line.name).c_str(), of.line.hz);
    text += of.peak ? formatted("%10.2f %12.1f\n", of.peak->hz, of.peak->level_db) : formatted("%10s %12s\n", "-", "-");
  }
  return text;
}

std::string to_json(const SoundAnalysis& a) {
  json states = json::array();
  for (const sound::StateSpan& span : a.states)
    states.push_back({{"state", sound::name(span.state)},
                      {"from_s", rounded(span.from_s)},
                      {"to_s", rounded(span.to_s)},
                      {"level", level_json(a, span.level_db)},
                      {"below_400_hz", level_json(a, span.low_db)}});
  json report = {
      {"kind", "sound analysis"},
      {"version", 1},
      {"recording",
       {{"sample_rate_hz", a.file_rate_hz},
        {"channels", a.file_channels},
        {"bits", a.file_bits},
        {"format", a.file_floating ? "float" : "integer"},
        {"seconds", rounded(seconds_of(a))},
        {"from_s", rounded(a.from_s)},
        {"file_s", rounded(a.file_s)},
        {"peak", rounded(a.peak, 1e6)},
        {"level", level_json(a, a.level_db)}}},
      {"analysis_rate_hz", a.rate_hz},
      {"spectrum_window", a.params.spectrum_window},
      {"spindle_rpm", a.params.spindle_rpm},
      {"states", states},
      {"spectra", spectra_json(a)},
      {"wavelet_packets", packets_json(a)},
      {"gear_lines", lines_json(a)},
      {"difference", nullptr},
  };
  if (a.clipped > 0) report["recording"]["clipped_samples"] = a.clipped;
  if (a.announced_s) report["recording"]["announced_s"] = rounded(*a.announced_s);
  if (a.difference)
    report["difference"] = {{"free_from_s", rounded(a.difference->free.from_s)},
                            {"free_to_s", rounded(a.difference->free.to_s)},
                            {"of", sound::name(a.difference->drilled)},
                            {"level", level_json(a, sound::band_db(a.difference->spectrum, 0.0, a.rate_hz))}};
  return report.dump(2) + "\n";
}

std::vector<NamedTable> tables_of(const SoundAnalysis& a, std::span<const DisplacementRow> displacement) {
  return {{"psd.csv", density_table(a)},     {"spectrogram.csv", spectrogram_table(a)},
          {"packets.csv", packet_table(a)},  {"states.csv", state_table(a)},
          {"gears.csv", gear_table_text(a)}, {"bands.csv", band_table(a, displacement)}};
}

Result<void> write_analysis(const SoundAnalysis& analysis, std::span<const DisplacementRow> displacement,
                            const fs::path& folder, const KeepGoing& keep_going) {
  return write_new_folder(folder, [&](const fs::path& partial) -> Result<void> {
    const std::vector<NamedTable> tables = tables_of(analysis, displacement);
    const std::vector<NamedPicture> pictures = pictures_of(analysis, displacement);
    const auto files = static_cast<double>(1 + tables.size() + pictures.size() + (analysis.difference ? 1 : 0));
    double done = 0.0;
    const auto counted = [&](Result<void> written) -> Result<void> {
      if (written && !keep_going(++done / files)) return stopped_while("writing " + folder.string());
      return written;
    };
    if (auto written = counted(write_file(partial / "analysis.json", to_json(analysis))); !written) return written;
    for (const NamedTable& table : tables)
      if (auto written = counted(write_file(partial / table.file, table.text)); !written) return written;
    for (const NamedPicture& of : pictures) {
      const auto png = of.picture.png();
      if (!png) return tl::unexpected(png.error());
      if (auto written = counted(write_file(partial / of.file, *png)); !written) return written;
    }
    if (!analysis.difference) return {};
    return counted(
        sound::write_wav(partial / "difference.wav", analysis.difference->samples, static_cast<int>(analysis.rate_hz)));
  });
}

}  // namespace osteon::audio
