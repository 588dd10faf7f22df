#include "audio_client/app/model_command.hpp"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "audio_client/analysis/analysis.hpp"
#include "audio_client/analysis/model_report.hpp"
#include "audio_client/analysis/recording_notes.hpp"
#include "audio_client/app/output_file.hpp"
#include "audio_client/app/recording_option.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/runtime/stoppable_progress.hpp"

namespace osteon::audio {
namespace {

struct ModelArguments {
  RecordingOption recording;
  std::string out, play;
  int refinements = 2;
  std::uint64_t seed = 1;
};

Result<std::string> run_model(const ModelArguments& a) {
  // What would be found after the work is found before it.
  if (auto usable = check_output(a.out, "the model", "--out", {{a.recording.file}}); !usable)
    return tl::unexpected(usable.error());
  if (auto usable = check_output(a.play, "the sound", "--play", {{a.recording.file}, {a.out, "the model"}}); !usable)
    return tl::unexpected(usable.error());
  const auto recording = read(a.recording);
  if (!recording) return tl::unexpected(recording.error());
  const StopSignal stop(StopSignal::HangUp::stops);
  StoppableProgress progress(stop, "modelling", kQuietWork);
  const auto made = model_report(*recording, a.refinements, a.seed, [&](double done) { return progress.go_on(done); });
  if (!made || stop.requested()) return stopped_before({a.out, a.play});
  const ModelReport& report = *made;
  std::string text = to_text(report) + recording_notes(*recording);
  if (!a.out.empty()) {
    if (auto written = write_file(a.out, report.bytes); !written) return tl::unexpected(written.error());
    text += "written    " + a.out + "\n";
  }
  if (!a.play.empty()) {
    if (auto written = sound::write_wav(a.play, report.sound, kAnalysisRate_hz); !written)
      return tl::unexpected(written.error());
    text += "written    " + a.play + "\n";
  }
  return text;
}

struct ResynthesiseArguments {
  std::string model, out;
  std::uint64_t seed = 1;
};

Result<std::string> run_resynthesis(const ResynthesiseArguments& a) {
  if (auto usable = check_output(a.out, "the sound", "OUT", {{a.model}}); !usable)
    return tl::unexpected(usable.error());
  const auto model = read_model(a.model);
  if (!model) return tl::unexpected(model.error());
  const std::vector<float> sound = sound::resynthesised(*model, a.seed);
  if (auto written = sound::write_wav(a.out, sound, static_cast<int>(model->rate_hz)); !written)
    return tl::unexpected(written.error());
  return "written    " + a.out + "\n";
}

}  // namespace

void add_model_commands(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  const auto model = std::make_shared<ModelArguments>();
  CLI::App* command = app.add_subcommand(
      "model", "Model a recording by partials, noise and impacts, and print how near the model's sound comes to it");
  add_recording(*command, model->recording);
  command->add_option("--out", model->out, "File for the model")->check(given_name());
  command->add_option("--play", model->play, "WAV file for the sound of the model")->check(given_name());
  command
      ->add_option("--refine", model->refinements,
                   "Rounds in which each peak is estimated again without the others; 0 is the fastest")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->add_option("--seed", model->seed, "Of the phases and the noise: the same gives the same sound")
      ->check(whole_number())
      ->capture_default_str();
  command->callback([model, &chosen] { chosen = [model] { return run_model(*model); }; });

  const auto again = std::make_shared<ResynthesiseArguments>();
  command = app.add_subcommand("resynthesise", "Make the sound of a model that the command model has written");
  command->add_option("MODEL", again->model, "File of a model")->required();
  command->add_option("OUT", again->out, "WAV file for its sound, 16 bit, mono")->required()->check(given_name());
  command->add_option("--seed", again->seed, "Of the phases and the noise: the same gives the same sound")
      ->check(whole_number())
      ->capture_default_str();
  command->callback([again, &chosen] { chosen = [again] { return run_resynthesis(*again); }; });
}

}  // namespace osteon::audio
