// osteon-audio preset: a recording as a preset, and the option --preset, by which the sound of the tools is played.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "audio_client/presets/tool_model.hpp"
#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

// Adds the command. Parsing sets `chosen` if it was given; it returns the text for standard output.
void add_preset_command(CLI::App& app, std::function<Result<std::string>()>& chosen);

// The presets of all these files and folders, in their order. A preset for no known tool is refused, since it would
// never be heard. Errors: one sentence.
[[nodiscard]] Result<std::vector<ToolModel>> presets_of(const std::vector<std::string>& files);

}  // namespace osteon::audio
