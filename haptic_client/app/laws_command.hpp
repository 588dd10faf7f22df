// `osteon-haptic laws`: the force laws as a list to read, or as JSON for programs.
#pragma once
#include <string>

namespace osteon::haptic {

// One paragraph for each law, the tools that use it by default, and how to choose another.
[[nodiscard]] std::string laws_text();
// {"laws": [...], "defaults": {kind: law}, "points": [...]}: the laws compute the compared points; none is quoted.
[[nodiscard]] std::string laws_json();

// The whole command; `argv[0]` is "laws". Returns the exit code.
int run_laws(int argc, const char* const* argv);

}  // namespace osteon::haptic
