// Requests of every call as a fuzz target, as far as they go before a room is asked: read, and taken apart by the
// checks of the wire. No server, so that millions of inputs take minutes; the target calls gives fewer to a server
// itself.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// Inputs as of calls_target().
[[nodiscard]] Target requests_target();

}  // namespace osteon::fuzz
