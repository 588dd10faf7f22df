// The presets of this folder, which the build embeds in the program, and those of a user's files.
#include <algorithm>
#include <span>
#include <system_error>
#include <utility>

#include "audio_client/presets/preset_file.hpp"
#include "common/core/check.hpp"
#include "common/runtime/files.hpp"

namespace osteon::audio {

// Name and text of each file. The build generates it from *.yaml.
std::span<const std::pair<std::string_view, std::string_view>> preset_files();

namespace {

Result<ToolModel> load_preset(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return failure(ErrorCode::not_found, "there is no preset " + file.string() + "; give a YAML file or a folder");
  if (const std::uintmax_t size = std::filesystem::file_size(file, error); !error && size > kLargestPreset_bytes)
    return bad_input(file.string() + " has " + std::to_string(size) + " bytes, and a preset has at most " +
                     std::to_string(kLargestPreset_bytes) + "; give a file of osteon-audio preset --out");
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  return parse_preset(*text, file.string());
}

}  // namespace

const std::vector<ToolModel>& builtin_presets() {
  static const std::vector<ToolModel> presets = [] {
    std::vector<ToolModel> made;
    for (const auto& [name, text] : preset_files()) {
      auto model = parse_preset(text, std::string(name));
      OSTEON_CHECK(model);
      made.push_back(std::move(*model));
    }
    return made;
  }();
  return presets;
}

Result<std::vector<ToolModel>> load_presets(const std::filesystem::path& file_or_folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  if (std::filesystem::is_directory(file_or_folder, error)) {
    for (auto entry = std::filesystem::directory_iterator(file_or_folder, error);
         !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
      if (entry->path().extension() == ".yaml") files.push_back(entry->path());
    if (error)
      return failure(ErrorCode::unavailable,
                     file_or_folder.string() + " cannot be read (" + error.message() + "); check its permissions");
    if (files.empty())
      return failure(ErrorCode::not_found,
                     file_or_folder.string() + " has no preset; give a folder with *.yaml files, or a file");
    std::ranges::sort(files);
  } else {
    files.push_back(file_or_folder);
  }
  std::vector<ToolModel> presets;
  for (const std::filesystem::path& file : files) {
    auto model = load_preset(file);
    if (!model) return tl::unexpected(model.error());
    presets.push_back(std::move(*model));
  }
  return presets;
}

}  // namespace osteon::audio
