// The tools in the groups of the window's left bar: those of Niu 2008, Table B.1, with the other built-in tools beside
// their kin.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

struct ToolGroup {
  std::string_view name;           // "drill", "bur", "saw", "reamer", "broach", "guide", "pin", "screw"
  std::vector<std::string> tools;  // names of built-in tools; the first one is shown at the beginning
  bool held = true;                // a hand cuts with it; the others are placed on the bone
};

// Eight groups in the order of the table. Every built-in tool is in exactly one of them.
[[nodiscard]] const std::vector<ToolGroup>& tool_groups();

}  // namespace osteon
