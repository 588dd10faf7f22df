#include "audio_client/analysis/model_report.hpp"

#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <utility>

#include "audio_client/analysis/analysis.hpp"
#include "common/core/check.hpp"
#include "common/runtime/files.hpp"
#include "common/sound/likeness.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/spectral_model_bytes.hpp"

namespace osteon::audio {
namespace {

Likeness likeness(std::string what, std::span<const float> original, std::span<const float> other) {
  return {.what = std::move(what),
          .snr_db = sound::snr_db(original, other),
          .psd_lsd_db = sound::psd_lsd_db(original, other, kAnalysisRate_hz),
          .mel_lsd_db = sound::mel_lsd_db(original, other, kAnalysisRate_hz),
          .envelope_error_db = sound::envelope_error_db(original, other, kAnalysisRate_hz)};
}

template <class... Values>
std::string line(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace

Result<ModelReport> model_report(const sound::WavSound& recording, int refinements, std::uint64_t seed,
                                 const KeepGoing& keep_going) {
  ModelReport report;
  const std::vector<float> original = sound::resampled(recording.samples, recording.rate_hz, kAnalysisRate_hz);
  sound::SpectralParams params;
  params.partials.peaks.refinements = refinements;
  // Time of the processor: other programs beside this one do not change it.
  const std::clock_t begin = std::clock();
  auto analysis = sound::spectral_analysis(original, kAnalysisRate_hz, params, part(keep_going, 0.0, 0.8));
  if (!analysis) return tl::unexpected(analysis.error());
  report.analysis = std::move(*analysis);
  report.work_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;

  report.bytes = sound::bytes_of(report.analysis.model);
  const auto kept = sound::model_from_bytes(report.bytes, "the model");
  OSTEON_CHECK(kept.has_value());
  report.sound = sound::resynthesised(*kept, seed);
  std::vector<float> with_phases = sound::resynthesised_noise(*kept, seed);
  for (std::size_t i = 0; i < original.size(); ++i) with_phases[i] += report.analysis.kept_sines[i];
  sound::put_transients(with_phases, kept->transients, kAnalysisRate_hz);
  const std::pair<const char*, std::span<const float>> others[] = {{"sines, with phases", report.analysis.sines},
                                                                   {"all, with phases", with_phases},
                                                                   {"the model, no phases", report.sound}};
  for (const auto& [what, other] : others) {
    if (!keep_going(0.85 + 0.05 * static_cast<double>(report.rows.size())))
      return stopped_while("comparing the model with the recording");
    report.rows.push_back(likeness(what, original, other));
  }
  return report;
}

std::string to_text(const ModelReport& report) {
  const sound::SpectralModel& model = report.analysis.model;
  const double seconds = static_cast<double>(model.samples) / model.rate_hz;
  std::size_t knots = 0, stored = 0;
  for (const auto& partial : model.partials) knots += partial.size();
  for (const sound::Transient& transient : model.transients) stored += transient.samples.size();
  std::string text = line("recording  %.2f s, modelled at %d Hz\n", seconds, kAnalysisRate_hz);
  text += line("partials   %zu, and %zu of them in the model by %zu knots\n", report.analysis.partials.size(),
               model.partials.size(), knots);
  for (const sound::NoiseModel& noise : model.noise)
    text += line("noise      %zu frames of %zu levels, %.0f to %.0f Hz\n", noise.frames, noise.points_hz.size(),
                 noise.params.from_hz, noise.params.to_hz);
  text += line("impacts    %zu, %.1f %% of the sound is kept as samples\n", model.transients.size(),
               model.samples > 0 ? 100.0 * static_cast<double>(stored) / static_cast<double>(model.samples) : 0.0);
  text +=
      line("model      %.1f KB, %.0f %% of the samples in 16 bits\n\n", 1e-3 * static_cast<double>(report.bytes.size()),
           50.0 * static_cast<double>(report.bytes.size()) / static_cast<double>(model.samples));
  text += line("%-22s %8s %12s %12s %10s\n", "", "snr_db", "psd_lsd_db", "mel_lsd_db", "env10ms_db");
  for (const Likeness& row : report.rows)
    text += line("%-22s %8.2f %12.2f %12.2f %10.2f\n", row.what.c_str(), row.snr_db, row.psd_lsd_db, row.mel_lsd_db,
                 row.envelope_error_db);
  return text + line("\nanalysed   in %.3f s of one processor, %.0f times as fast as it sounds\n", report.work_s,
                     seconds / report.work_s);
}

Result<sound::SpectralModel> read_model(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    return failure(ErrorCode::not_found, "there is no file " + file + "; give one that osteon-audio model --out wrote");
  if (!std::filesystem::is_regular_file(file, error))
    return bad_input(file + " is a folder, a device or a pipe; give a file of osteon-audio model --out");
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && size > sound::kLargestModel_bytes)
    return bad_input(file + " has " + std::to_string(size) + " bytes, and a model has at most " +
                     std::to_string(sound::kLargestModel_bytes) + "; give a file of osteon-audio model --out");
  const Result<std::string> bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  return sound::model_from_bytes(*bytes, file);
}

}  // namespace osteon::audio
