#include "audio_client/app/preset_command.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "audio_client/analysis/recording_notes.hpp"
#include "audio_client/app/output_file.hpp"
#include "audio_client/app/recording_option.hpp"
#include "audio_client/presets/preset_file.hpp"
#include "audio_client/presets/recorded_preset.hpp"
#include "common/core/bounded_text.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/runtime/stoppable_progress.hpp"
#include "common/tools/tool.hpp"
#include "common/tools/tool_file.hpp"

namespace osteon::audio {
namespace {

struct PresetArguments {
  RecordingOption recording;
  std::string out, tool = "drill", name;
  double rpm = 0;
  int refinements = 0;
};

// Kinds of tools and names, and the sucker.
bool known_tool(const std::string& wanted) {
  return wanted == "suction" || std::ranges::any_of(builtin_tools(), [&](const Tool& tool) {
           return tool.name == wanted || kind_name(tool.kind) == wanted;
         });
}

// The preset of a kind or name; null for a tool without a sound.
const ToolModel* base_for(const std::string& wanted) {
  for (const Tool& tool : builtin_tools())
    if (tool.name == wanted || kind_name(tool.kind) == wanted)
      return preset_for(builtin_presets(), tool.name, kind_name(tool.kind));
  return preset_for(builtin_presets(), wanted, wanted);
}

Result<std::string> run_preset(const PresetArguments& a) {
  const ToolModel* base = base_for(a.tool);
  if (!base) {
    std::string kinds;
    for (const ToolModel& model : builtin_presets())
      for (const std::string& kind : model.tools) kinds += (kinds.empty() ? "" : ", ") + kind;
    return bad_input("--tool \"" + bounded_text(a.tool, 60) +
                     "\" is no tool that sounds; give the name of a tool, or " + "one of " + kinds);
  }
  if (auto usable = check_output(a.out, "the preset", "--out", {{a.recording.file}}); !usable)
    return tl::unexpected(usable.error());
  const auto recording = read(a.recording);
  if (!recording) return tl::unexpected(recording.error());
  RecordedParams params{.name = a.name.empty() ? std::filesystem::path(a.out).stem().string() : a.name,
                        .tools = {},
                        .rpm = a.rpm,
                        .refinements = a.refinements};
  params.name = bounded_text(params.name.substr(0, 60));
  if (std::ranges::find(base->tools, a.tool) == base->tools.end()) params.tools = {a.tool};
  const StopSignal stop(StopSignal::HangUp::stops);
  StoppableProgress progress(stop, "modelling", kQuietWork);
  auto made = recorded_preset(recording->samples, recording->rate_hz, *base, params,
                              [&](double done) { return progress.go_on(done); });
  if (stop.requested() || (!made && made.error().code == ErrorCode::cancelled)) return stopped_before({a.out});
  if (!made) return failure(made.error().code, a.recording.file + ": " + made.error().message);
  const std::string yaml = to_yaml(made->model);
  if (auto written = write_file(a.out, yaml); !written) return tl::unexpected(written.error());
  std::string tools;
  for (const std::string& tool : made->model.tools) tools += (tools.empty() ? "" : ", ") + tool;
  return made->text + recording_notes(*recording) + "for        " + tools + "\nwritten    " + a.out + ", " +
         std::to_string(yaml.size()) + " bytes\n";
}

}  // namespace

Result<std::vector<ToolModel>> presets_of(const std::vector<std::string>& files) {
  std::vector<ToolModel> presets;
  for (const std::string& file : files) {
    auto loaded = load_presets(file);
    if (!loaded) return tl::unexpected(loaded.error());
    for (ToolModel& model : *loaded) {
      if (std::ranges::none_of(model.tools, known_tool))
        return bad_input(file + ": the \"tools\" of the preset " + model.name + " name no known tool, such as " +
                         bounded_text(model.tools.front(), 60) + "; write kinds such as drill, or names of tools");
      presets.push_back(std::move(model));
    }
  }
  return presets;
}

void add_preset_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  const auto a = std::make_shared<PresetArguments>();
  CLI::App* command =
      app.add_subcommand("preset", "Make a preset from a recording of a tool, to be played by osteon-audio --preset");
  add_recording(*command, a->recording);
  command->add_option("--out", a->out, "File for the preset, YAML")->required()->check(given_name());
  command->add_option("--tool", a->tool, "The tool that was recorded: a kind such as drill or broach, or its name")
      ->capture_default_str();
  command
      ->add_option("--rpm", a->rpm,
                   "Its speed when it ran free, turns or strokes a minute; by default that of the tool's own preset")
      ->check(number_in(1.0, 200000.0));
  command->add_option("--name", a->name, "Name of the preset; by default that of the file");
  command
      ->add_option("--refine", a->refinements,
                   "Rounds in which each peak is estimated again without the others; 0 is the fastest")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->callback([a, &chosen] { chosen = [a] { return run_preset(*a); }; });
}

}  // namespace osteon::audio
