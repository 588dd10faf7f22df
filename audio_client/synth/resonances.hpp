// Frequencies of bodies that ring while a tool works: the plate of cortex under it, and the blade of a saw.
#pragma once

namespace osteon::audio {

// Lowest mode of a round plate that is clamped at its edge (Leissa 1969, table 2.1):
//   f = 10.22 / (2 pi R^2) sqrt(E h^2 / (12 rho (1 - nu^2)))
// with E = 17 GPa and nu = 0.3 of cortical bone (Reilly 1975) and its density of 1.9 g/cm3. The plate stands for the
// cortex between parts that hold it; its radius is an assumption [A]. The thinner the cortex that is left, the lower it
// sounds. The formula fails where the thickness is not small against the radius.
[[nodiscard]] double plate_mode_hz(double thickness_mm, double radius_mm) noexcept;

// Mode `index` (0 to 4) of a steel beam that is held at one end (Leissa 1969; Euler and Bernoulli):
//   f = k^2 / (2 pi L^2) sqrt(E h^2 / (12 rho)), cos k cosh k = -1
// with E = 200 GPa and rho = 7.85 g/cm3.
[[nodiscard]] double beam_mode_hz(int index, double length_mm, double thickness_mm) noexcept;

}  // namespace osteon::audio
