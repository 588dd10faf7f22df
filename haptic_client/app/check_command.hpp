// `osteon-haptic check`: says what this machine lacks for a loop of 1 kHz, and how to set it.
#pragma once

namespace osteon::haptic {

// Prints one sentence for each finding, then runs an empty loop for a second. Exit codes: 0: nothing is lacking; 1:
// something is lacking; 2: the arguments are wrong.
int run_check(int argc, char** argv);

}  // namespace osteon::haptic
