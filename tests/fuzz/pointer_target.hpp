// Fuzz targets for the messages between a window and its haptic and audio client.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target pointer_message_target();  // of either end
[[nodiscard]] Target sound_message_target();    // of either end

}  // namespace osteon::fuzz
