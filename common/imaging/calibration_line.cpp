#include "common/imaging/calibration_line.hpp"

#include <cmath>

namespace osteon::imaging {

double CalibrationLine::error_g_cm3(double density_g_cm3) const {
  const double away = density_g_cm3 - mean_g_cm3;
  return deviation_hu / hu_per_g_cm3 * std::sqrt(1.0 + 1.0 / readings + away * away / squares);
}

Result<CalibrationLine> fit_calibration(std::span<const DensityReading> readings) {
  CalibrationLine line;
  line.readings = static_cast<int>(readings.size());
  double mean_hu = 0.0;
  for (const DensityReading& r : readings) {
    line.mean_g_cm3 += r.density_g_cm3 / line.readings;
    mean_hu += r.hu / line.readings;
  }
  double products = 0.0;
  for (const DensityReading& r : readings) {
    const double away = r.density_g_cm3 - line.mean_g_cm3;
    line.squares += away * away;
    products += away * (r.hu - mean_hu);
  }
  if (!(line.squares > 0.0)) return bad_input("a calibration needs two materials of different density");
  line.hu_per_g_cm3 = products / line.squares;
  if (!(line.hu_per_g_cm3 > 0.0)) return bad_input("the HU of the known materials do not rise with their density");
  line.hu_of_nothing = mean_hu - line.hu_per_g_cm3 * line.mean_g_cm3;
  if (line.readings < 3) return line;
  double rest = 0.0;
  for (const DensityReading& r : readings)
    rest += std::pow(r.hu - line.hu_of_nothing - line.hu_per_g_cm3 * r.density_g_cm3, 2);
  line.deviation_hu = std::sqrt(rest / (line.readings - 2));
  return line;
}

}  // namespace osteon::imaging
