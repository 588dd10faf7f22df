// Preset files: the sound of a group of tools in YAML. They hold levels, orders and times, and no sound but the impacts
// of a recording: at most 20 ms each, and together at most a tenth of it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "audio_client/presets/tool_model.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

inline constexpr std::uintmax_t kLargestPreset_bytes = 512U << 10U;

// `file`: for messages. Errors are one sentence that names the file, the field and the remedy.
[[nodiscard]] Result<ToolModel> parse_preset(std::string_view text, const std::string& file);

// A file that gives the same model again. Its levels are rounded to 0.01 dB.
[[nodiscard]] std::string to_yaml(const ToolModel& model);

// A preset file, or all *.yaml of a folder in the order of their names. Errors: not_found, invalid_input.
[[nodiscard]] Result<std::vector<ToolModel>> load_presets(const std::filesystem::path& file_or_folder);

// The presets that come with Osteon, one for each group of tools. The build embeds them in the program.
[[nodiscard]] const std::vector<ToolModel>& builtin_presets();

// The first of `presets` that names this tool, or else the first that names its kind; null if there is none.
[[nodiscard]] const ToolModel* preset_for(const std::vector<ToolModel>& presets, std::string_view tool_name,
                                          std::string_view tool_kind);

}  // namespace osteon::audio
