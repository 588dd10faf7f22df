// Fuzz target for what a viewer that holds the bone is sent. Whatever came, the next sound stream makes it right.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target field_messages_target();

}  // namespace osteon::fuzz
