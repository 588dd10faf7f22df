// Characteristic frequencies of a drill's hand piece, as multiples of the spindle's frequency (8.1-8.4, Table 8.1).
#pragma once
#include <string_view>
#include <vector>

namespace osteon::sound {

// A planetary set with a fixed ring: the sun drives, the planet carrier is driven.
struct PlanetarySet {
  int ring = 1, sun = 1, planet = 1;  // teeth

  [[nodiscard]] constexpr double reduction() const { return 1.0 + static_cast<double>(ring) / sun; }  // (8.1)
  // Turns of the planets per turn of the carrier (8.2).
  [[nodiscard]] constexpr double planet_spin() const { return static_cast<double>(ring) / planet; }
  // Teeth that mesh per turn of the carrier (8.3); sun and ring mesh at the same frequency.
  [[nodiscard]] constexpr double mesh() const { return ring; }
};

// Two sets between motor and spindle. Table 8.1 gives only the products; these tooth numbers yield them. The output
// set: mesh 48 and planet spin 3.2, with a reduction of 3.824. The motor's set: mesh 172.08 = 45 x 3.824 and planet
// spin 11.472 = 3 x 3.824, with a reduction of 4.
struct Gearbox {
  PlanetarySet motor_end{.ring = 45, .sun = 15, .planet = 15};
  PlanetarySet output_end{.ring = 48, .sun = 17, .planet = 15};

  [[nodiscard]] constexpr double transfer() const { return output_end.reduction(); }
  [[nodiscard]] constexpr double motor() const { return output_end.reduction() * motor_end.reduction(); }
  [[nodiscard]] constexpr double output_mesh() const { return output_end.mesh(); }
  [[nodiscard]] constexpr double output_spin() const { return output_end.planet_spin(); }
  [[nodiscard]] constexpr double motor_mesh() const { return motor_end.mesh() * transfer(); }
  [[nodiscard]] constexpr double motor_spin() const { return motor_end.planet_spin() * transfer(); }
};

// Segments of the drill motor's commutator (8.4). At 1400 rpm five segments put the third harmonic at 5353 Hz and the
// first at 1784 Hz. There 8.5.4 finds the motor's 5400-5500 Hz and 1800 Hz.
inline constexpr int kCommutatorSegments = 5;

// A row of Table 8.1, or a harmonic of the motor's commutation (8.4).
struct GearLine {
  std::string_view name;
  double ratio = 1;  // to the spindle's frequency
  double hz = 0;
};

// The three shafts, both gear meshes with the spin of their planets, and harmonics: of the output mesh, which are heard
// up to the fourth (8.5.4), and of the commutation, of which the third is the loudest.
// `spindle_rpm`: speed of the output shaft, revolutions a minute, above 0.
[[nodiscard]] std::vector<GearLine> gear_table(const Gearbox& gears, double spindle_rpm);

}  // namespace osteon::sound
