#include "audio_client/app/analyse_command.hpp"

#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <vector>

#include "audio_client/analysis/analysis.hpp"
#include "audio_client/analysis/analysis_report.hpp"
#include "audio_client/analysis/displacement_file.hpp"
#include "audio_client/app/output_file.hpp"
#include "audio_client/app/recording_option.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/runtime/stoppable_progress.hpp"

namespace osteon::audio {
namespace {

struct AnalyseArguments {
  RecordingOption recording;
  std::string displacement, out;
  std::vector<double> free_s;
  double spindle_rpm = 1400, displacement_start_s = 0;
  std::optional<double> full_scale_pa;
};

std::string shown(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

Result<std::optional<sound::TimeSpan>> free_span(const AnalyseArguments& a, double seconds) {
  if (a.free_s.empty()) return std::optional<sound::TimeSpan>();
  const sound::TimeSpan span{a.free_s[0], a.free_s[1]};
  if (!(span.from_s >= 0 && span.to_s <= seconds && span.to_s - span.from_s >= 0.1))  // not true of nan
    return bad_input("--free must be two times within the " + shown(seconds) + " s of " + a.recording.file +
                     ", the second at least 0.1 s after the first");
  return std::optional(span);
}

// The displacement over the recording's time; empty if none is given.
Result<std::vector<DisplacementRow>> displacement_of(const AnalyseArguments& a, double seconds) {
  if (a.displacement.empty()) return std::vector<DisplacementRow>();
  auto rows = read_displacement(a.displacement, a.displacement_start_s);
  if (rows && (rows->front().time_s > seconds || rows->back().time_s < 0))
    return bad_input(a.displacement + ": its times are " + shown(rows->front().time_s + a.displacement_start_s) +
                     " to " + shown(rows->back().time_s + a.displacement_start_s) + " s, and the recording has " +
                     shown(a.displacement_start_s) + " to " + shown(a.displacement_start_s + seconds) +
                     " s; give --displacement-start the table's time at which the recording begins");
  return rows;
}

Result<std::string> run_analysis(const AnalyseArguments& a) {
  // What would be found after the work is found before it.
  if (!a.out.empty())
    if (auto usable = check_new_folder(a.out, "--out"); !usable) return tl::unexpected(usable.error());
  const auto recording = read(a.recording);
  if (!recording) return tl::unexpected(recording.error());
  const auto free = free_span(a, recording->seconds());
  if (!free) return tl::unexpected(free.error());
  const auto displacement = displacement_of(a, recording->seconds());
  if (!displacement) return tl::unexpected(displacement.error());

  AnalysisParams params;
  params.spindle_rpm = a.spindle_rpm;
  params.full_scale_pa = a.full_scale_pa;
  params.free = *free;
  const StopSignal stop(StopSignal::HangUp::stops);
  StoppableProgress progress(stop, "analysing", kQuietWork);
  const KeepGoing go_on = [&](double done) { return progress.go_on(done); };
  const double analysed = a.out.empty() ? 1.0 : 0.5;  // of the work
  // Of the processor, because other programs may run beside this one.
  const std::clock_t begin = std::clock();
  const auto analysis = analyse(*recording, params, part(go_on, 0.0, analysed));
  if (!analysis) return stopped_before({a.out});
  const double work_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::array<char, 96> speed{};
  std::snprintf(speed.data(), speed.size(), "\nanalysed   in %.3f s of a processor, %.0f times as fast as it sounds\n",
                work_s, recording->seconds() / work_s);
  std::string text = to_text(*analysis) + speed.data();
  if (a.out.empty()) return text;
  const auto written = write_analysis(*analysis, *displacement, a.out, part(go_on, analysed, 1.0));
  if (!written && written.error().code == ErrorCode::cancelled) return stopped_before({a.out});
  if (!written) return tl::unexpected(written.error());
  return text + "written    " + a.out + ": analysis.json, tables (*.csv) and pictures (*.png)\n";
}

}  // namespace

void add_analyse_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  const auto shared = std::make_shared<AnalyseArguments>();
  AnalyseArguments& a = *shared;
  CLI::App* command = app.add_subcommand(
      "analyse", "Analyse a recorded drilling: its states, spectra, wavelet packets, and the lines of the gears");
  add_recording(*command, a.recording);
  CLI::Option* out =
      command
          ->add_option("--out", a.out,
                       "Folder, made by this command: analysis.json, tables (psd.csv, spectrogram.csv, packets.csv, "
                       "states.csv, gears.csv, bands.csv), pictures, and the sound difference (difference.wav)")
          ->check(given_name());
  command
      ->add_option("--rpm", a.spindle_rpm,
                   "Speed of the spindle, which says where the lines of the gears are; they are those of "
                   "the dissertation's drill")
      ->check(number_in(10.0, 100000.0))
      ->capture_default_str();
  command
      ->add_option("--free", a.free_s,
                   "FROM TO: seconds in which the drill ran free; by default the longest such state that is found")
      ->expected(2);
  CLI::Option* displacement =
      command
          ->add_option("--displacement", a.displacement,
                       "CSV with time_s and displacement_mm, or a session log of osteon-haptic: drawn over the bands")
          ->needs(out);
  command
      ->add_option("--displacement-start", a.displacement_start_s,
                   "Time in that table at which the recording begins, seconds")
      ->needs(displacement)
      ->check(number_in(-1e6, 1e6))
      ->capture_default_str();
  command
      ->add_option("--full-scale-pa", a.full_scale_pa,
                   "Sound pressure of full scale, Pa, from a calibrated recording: also prints levels re 20 uPa")
      ->check(number_in(1e-6, 1e6));
  command->callback([shared, &chosen] { chosen = [shared] { return run_analysis(*shared); }; });
}

}  // namespace osteon::audio
