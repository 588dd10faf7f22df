// Every call of a server as a fuzz target: any bytes for any request, given to the services themselves.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// The first byte of an input says which call, the others are its request.
[[nodiscard]] Target calls_target();

}  // namespace osteon::fuzz
