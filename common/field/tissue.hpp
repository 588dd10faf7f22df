// The material of a sample of a case's bone.
#pragma once
#include <cstdint>

namespace osteon {

// Enamel is everything that a scan shows denser than compact bone and that is not metal. Tools cut it like compact
// bone. No tool cuts metal.
enum class Tissue : std::uint8_t { none = 0, cortical = 1, trabecular = 2, metal = 3, enamel = 4 };

// Bone from this density on counts as cortical. [A] Apparent densities of cancellous bone end near here.
inline constexpr float kCorticalFrom_g_cm3 = 1.0f;

}  // namespace osteon
