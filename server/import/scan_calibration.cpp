#include "server/import/scan_calibration.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "common/imaging/calibration_rods.hpp"
#include "common/imaging/hu_scale.hpp"
#include "common/imaging/threshold.hpp"

namespace osteon::import {
namespace {

// Ash is 0.6 of the mass of wet bone, and a phantom of hydroxyapatite shows the density of ash (Knowles 2016, table 1).
constexpr double kAshPart = 0.6;

void set_errors(LabelProvenance& provenance, double cancellous_g_cm3, double cortical_g_cm3) {
  provenance.parameters[kCancellousError] = cancellous_g_cm3;
  provenance.parameters[kCorticalError] = cortical_g_cm3;
}

std::string rod_text(const imaging::CalibrationRod& rod, double given_g_cm3, const imaging::CalibrationLine& line) {
  std::array<char, 200> text{};
  const double residual = line.calibration().intercept_g_cm3 + line.calibration().slope_g_cm3_per_hu * rod.reading.hu -
                          rod.reading.density_g_cm3;
  std::snprintf(
      text.data(), text.size(),
      "rod        %.4g g/cm3: %.1f +- %.1f HU, %+.4f g/cm3 from the line; at %.1f %.1f %.1f, read %.1f mm wide "
      "and %.0f mm long\n",
      given_g_cm3, rod.reading.hu, rod.deviation_hu, residual, rod.centre_mm.x(), rod.centre_mm.y(), rod.centre_mm.z(),
      rod.diameter_mm, rod.length_mm);
  return text.data();
}

Result<ScanCalibration> calibrate_by_rods(const imaging::HuVolume& scan, const CalibrationOptions& options,
                                          const KeepGoing& keep_going) {
  const double apparent = options.rods_of == RodMaterial::hydroxyapatite ? 1.0 / kAshPart : 1.0;
  std::vector<double> densities;
  for (const double given : options.rods_g_cm3) densities.push_back(apparent * given);
  const auto rods = imaging::find_rods(scan, densities, keep_going);
  if (!rods) return tl::unexpected(rods.error());
  std::vector<imaging::DensityReading> readings;
  for (const imaging::CalibrationRod& rod : *rods) readings.push_back(rod.reading);
  const auto line = imaging::fit_calibration(readings);
  if (!line) return tl::unexpected(line.error());
  ScanCalibration found{.line = line->calibration(), .provenance = {.method = "rods in the scan"}};
  if (apparent != 1.0) found.provenance.method += ", of hydroxyapatite";
  for (std::size_t i = 0; i < rods->size(); ++i) {
    const double given = (*rods)[i].reading.density_g_cm3 / apparent;
    const std::string name = "rod_" + std::to_string(i + 1);
    found.provenance.parameters[name + "_g_cm3"] = given;
    found.provenance.parameters[name + "_hu"] = (*rods)[i].reading.hu;
    found.text += rod_text((*rods)[i], given, *line);
  }
  if (line->readings > 2)
    set_errors(found.provenance, line->error_g_cm3(imaging::kCancellous_g_cm3),
               line->error_g_cm3(imaging::kCortical_g_cm3));
  return found;
}

// The line of Rho 1995, for the HU as they are or after their scale was corrected.
Result<ScanCalibration> calibrate_by_tissue(imaging::HuVolume& scan, bool rescale, const KeepGoing& keep_going) {
  ScanCalibration found{.provenance = {.method = "Rho 1995, cancellous bone of the proximal femur"}};
  double cancellous = imaging::kRhoCancellousError_g_cm3, cortical = imaging::kRhoCorticalError_g_cm3;
  if (rescale) {
    const auto histogram = imaging::hu_histogram(scan, part(keep_going, 0.0, 0.5));
    if (!histogram) return tl::unexpected(histogram.error());
    const auto scale = imaging::measure_hu_scale(*histogram);
    if (!scale) return tl::unexpected(scale.error());
    if (auto done = imaging::rescale_hu(scan, *scale, part(keep_going, 0.5, 1.0)); !done)
      return tl::unexpected(done.error());
    const auto with_scale = [&](double error, double density) {
      return std::hypot(
          error, found.line.slope_g_cm3_per_hu * imaging::HuScale::error_hu(imaging::hounsfield(found.line, density)));
    };
    cancellous = with_scale(cancellous, imaging::kCancellous_g_cm3);
    cortical = with_scale(cortical, imaging::kCortical_g_cm3);
    found.provenance.method += "; HU rescaled from air and soft tissue";
    found.provenance.parameters["air_hu"] = scale->air_hu;
    found.provenance.parameters["soft_tissue_hu"] = scale->soft_tissue_hu;
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), "HU         air had %.1f and soft tissue %.1f HU; now %.0f and %.0f HU\n",
                  scale->air_hu, scale->soft_tissue_hu, imaging::kAir_hu, imaging::kSoftTissue_hu);
    found.text = text.data();
  }
  set_errors(found.provenance, cancellous, cortical);
  return found;
}

}  // namespace

Result<ScanCalibration> calibrate_scan(imaging::HuVolume& scan, const CalibrationOptions& options,
                                       const KeepGoing& keep_going) {
  const bool rods = !options.rods_g_cm3.empty();
  if ((options.line && rods) || (options.rescale_hu && (options.line || rods)))
    return bad_input("the density has one calibration; give only one of --calibration, --rods and --rescale-hu");
  if (rods) return calibrate_by_rods(scan, options, keep_going);
  if (!options.line) return calibrate_by_tissue(scan, options.rescale_hu, keep_going);
  if (!(options.line->slope_g_cm3_per_hu > 0.0) || !std::isfinite(options.line->slope_g_cm3_per_hu) ||
      !std::isfinite(options.line->intercept_g_cm3))
    return bad_input("the slope of --calibration must be above zero, because denser bone has more HU");
  return ScanCalibration{.line = *options.line, .provenance = {.method = "given"}};
}

}  // namespace osteon::import
