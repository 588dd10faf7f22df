// `osteon-haptic plan check FILE...`: checks plans without a server.
#pragma once

namespace osteon::haptic {

// The whole command; `argv[0]` is "plan". Prints one line for each plan that is valid. Returns the exit code: 1 after
// the first plan that is not, which it names with step, field and remedy.
int run_plan(int argc, const char* const* argv);

}  // namespace osteon::haptic
