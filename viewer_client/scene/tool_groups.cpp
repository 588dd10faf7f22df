#include "viewer_client/scene/tool_groups.hpp"

namespace osteon {

const std::vector<ToolGroup>& tool_groups() {
  static const std::vector<ToolGroup> groups{
      {"drill", {"drill-3.2", "drill-3.5", "drill-1-8in", "drill-5-16in", "end-drill"}},
      {"bur", {"burr-round-5", "burr-round-3.2", "burr-round", "burr-barrel", "burr-contoured"}},
      {"saw", {"saw-oscillating-1", "saw-oscillating-2", "saw-oscillating-3", "saw-reciprocating"}},
      {"reamer", {"reamer-sphere", "reamer-cylinder", "reamer-outside"}},
      {"broach", {"broach-1", "broach-2"}},
      {"guide", {"guide-1", "guide-2", "guide-3", "trial-cup-50", "trial-stem"}, false},
      {"pin", {"pin-1", "pin-2", "pin-3"}, false},
      {"screw", {"screw-1", "screw-2", "screw-3"}, false}};
  return groups;
}

}  // namespace osteon
