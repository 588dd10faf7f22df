// Fuzz target for the requests of every call, before they reach a room: they are parsed and checked by the wire layer.
// It runs no server, so millions of inputs take minutes. The target `calls` gives fewer inputs to a real server.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// Takes the same inputs as calls_target().
[[nodiscard]] Target requests_target();

}  // namespace osteon::fuzz
