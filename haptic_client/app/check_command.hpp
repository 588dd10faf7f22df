// `osteon-haptic check`: what this machine lacks for a loop of 1 kHz, and how to set it.
#pragma once

namespace osteon::haptic {

// Prints one sentence for each finding, then a second of an empty loop. 0: nothing is lacking; 1: something is; 2: the
// arguments are wrong.
int run_check(int argc, char** argv);

}  // namespace osteon::haptic
