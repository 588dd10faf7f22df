#include "server/import/corrected_cortex.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "common/imaging/thin_cortex.hpp"

namespace osteon::import {
namespace {

std::string cortex_text(const imaging::CortexCorrection& made, const DensityCalibration& line) {
  const Vec3& sigma = made.spread.sigma_mm;
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(),
                "blur       sigma %.2f x %.2f x %.2f mm along columns, rows and slices, from %d edges", sigma.x(),
                sigma.y(), sigma.z(), made.spread.edges);
  std::string lines = text.data();
  if (!std::ranges::all_of(made.spread.measured, [](bool m) { return m; }))
    lines += "; half a voxel is assumed where no edge shows it";
  std::snprintf(text.data(), text.size(),
                "\ncortex     %.2f g/cm3 (%s), corrected at %.0f %% of the surface\n"
                "           a tenth of it is thinner than %.2f mm, half than %.2f mm, nine tenths than %.2f mm\n",
                imaging::density_g_cm3(line, made.cortex_hu),
                made.cortex_measured ? "measured where it is thick" : "assumed, because none is thick",
                made.points > 0 ? 100.0 * static_cast<double>(made.corrected) / static_cast<double>(made.points) : 0.0,
                made.thickness_mm[0], made.thickness_mm[1], made.thickness_mm[2]);
  return lines + text.data();
}

}  // namespace

Result<SparseVolume> correct_cortex(const imaging::HuVolume& volume, const SparseVolume& surface_mm, double pitch_mm,
                                    ScanCalibration& calibration, const KeepGoing& keep_going) {
  auto made = imaging::correct_thin_cortex(volume, surface_mm, pitch_mm, calibration.line, keep_going);
  if (!made) return tl::unexpected(made.error());
  calibration.text += cortex_text(*made, calibration.line);
  calibration.provenance.method += "; thin cortex corrected";
  auto& parameters = calibration.provenance.parameters;
  parameters["point_spread_columns_mm"] = made->spread.sigma_mm.x();
  parameters["point_spread_rows_mm"] = made->spread.sigma_mm.y();
  parameters["point_spread_slices_mm"] = made->spread.sigma_mm.z();
  parameters["cortex_g_cm3"] = imaging::density_g_cm3(calibration.line, made->cortex_hu);
  parameters["cortex_measured"] = made->cortex_measured ? 1.0 : 0.0;
  parameters["cortex_corrected_part"] =
      made->points > 0 ? static_cast<double>(made->corrected) / static_cast<double>(made->points) : 0.0;
  return std::move(made->change_hu);
}

}  // namespace osteon::import
