// Source of random bytes as a parameter: the system's for keys and challenges, a seeded one in simulations.
#pragma once
#include <cstdint>
#include <functional>
#include <span>

namespace osteon {

// Fills the whole span.
using FillRandom = std::function<void(std::span<std::uint8_t>)>;
// Suitable for keys. Any thread.
[[nodiscard]] FillRandom system_random();

}  // namespace osteon
