// Fuzz target for every call of a server. It gives any bytes as any request to the services themselves.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// The first byte of an input selects the call. The other bytes are the request.
[[nodiscard]] Target calls_target();

}  // namespace osteon::fuzz
