// The tool box of Appendix B: the files of common/tools/box, which the build embeds in the program.
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "common/tools/tool_file.hpp"

namespace osteon {

// Name and text of each file, in the order in which tools are listed. The build generates it from box/*.yaml.
std::span<const std::pair<std::string_view, std::string_view>> box_files();

std::span<const Tool> builtin_tools() {
  static const std::vector<Tool> tools = [] {
    std::vector<Tool> made;
    for (const auto& [name, text] : box_files()) {
      const auto tool = parse_tool(text, std::string(name));
      OSTEON_CHECK(tool);
      made.push_back(*tool);
    }
    return made;
  }();
  return tools;
}

Result<Tool> find_tool(std::string_view name) {
  std::string known;
  for (const Tool& tool : builtin_tools()) {
    if (tool.name == name) return tool;
    known += (known.empty() ? "" : ", ") + tool.name;
  }
  return failure(ErrorCode::not_found, "there is no tool \"" + std::string(name) + "\"; choose one of " + known);
}

}  // namespace osteon
