// Random bytes as a parameter: the system's for keys and challenges, seeded ones in simulations.
#pragma once
#include <cstdint>
#include <functional>
#include <span>

namespace osteon {

// Fills all of it.
using FillRandom = std::function<void(std::span<std::uint8_t>)>;
// Fit for keys. Any thread.
[[nodiscard]] FillRandom system_random();

}  // namespace osteon
