#include "common/sound/gearbox.hpp"

#include "common/core/check.hpp"

namespace osteon::sound {

std::vector<GearLine> gear_table(const Gearbox& gears, double spindle_rpm) {
  OSTEON_CHECK(spindle_rpm > 0);
  const double commutation = kCommutatorSegments * gears.motor();
  std::vector<GearLine> table = {
      {"output shaft", 1.0},
      {"transfer shaft", gears.transfer()},
      {"motor shaft", gears.motor()},
      {"output mesh", gears.output_mesh()},
      {"output mesh x2", 2.0 * gears.output_mesh()},
      {"output mesh x3", 3.0 * gears.output_mesh()},
      {"output mesh x4", 4.0 * gears.output_mesh()},
      {"output spin", gears.output_spin()},
      {"motor mesh", gears.motor_mesh()},
      {"motor spin", gears.motor_spin()},
      {"commutation", commutation},
      {"commutation x2", 2.0 * commutation},
      {"commutation x3", 3.0 * commutation},
  };
  for (GearLine& line : table) line.hz = line.ratio * spindle_rpm / 60.0;
  return table;
}

}  // namespace osteon::sound
