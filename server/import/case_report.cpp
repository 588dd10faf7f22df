#include "server/import/case_report.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace osteon::import {
namespace {

// Segmented bones and meshes have no Hounsfield units.
std::string density_text(const CaseInfo& info) {
  if (info.calibration == DensityCalibration{}) return "density    given with the shape\n";
  char text[160];
  std::snprintf(text, sizeof text, "threshold  %.6g HU\ndensity    %.6g + %.6g HU g/cm3\n", info.threshold_hu,
                info.calibration.intercept_g_cm3, info.calibration.slope_g_cm3_per_hu);
  return text;
}

}  // namespace

std::string report_text(const Case& bone) {
  const CaseInfo& info = bone.info();
  const Box box = bone.bounds();
  char text[512];
  std::snprintf(text, sizeof text,
                "pitch      %.6g mm\n"
                "%s"
                "bounds     %.2f..%.2f  %.2f..%.2f  %.2f..%.2f mm (LPS)\n"
                "bone       %.2f cm3\n",
                info.pitch_mm, density_text(info).c_str(), box.min_mm.x(), box.max_mm.x(), box.min_mm.y(),
                box.max_mm.y(), box.min_mm.z(), box.max_mm.z(), bone.volume_mm3() * 1e-3);
  return "title      " + info.title + "\nsource     " + info.source + "\n" + text + "hash       " +
         to_hex(bone.hash()) + "\n";
}

std::string report_json(const Case& bone) {
  const CaseInfo& info = bone.info();
  const Box box = bone.bounds();
  const auto list = [](const Vec3& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); };
  const nlohmann::json report{{"title", info.title},
                              {"source", info.source},
                              {"pitch_mm", info.pitch_mm},
                              {"threshold_hu", info.threshold_hu},
                              {"calibration",
                               {{"slope_g_cm3_per_hu", info.calibration.slope_g_cm3_per_hu},
                                {"intercept_g_cm3", info.calibration.intercept_g_cm3}}},
                              {"bounds_mm", {{"min", list(box.min_mm)}, {"max", list(box.max_mm)}}},
                              {"bone_volume_mm3", bone.volume_mm3()},
                              {"hash", to_hex(bone.hash())}};
  return report.dump(2) + "\n";
}

}  // namespace osteon::import
