#include "server/import/case_report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/imaging/calibration.hpp"
#include "server/import/scan_calibration.hpp"

namespace osteon::import {
namespace {

// How the density was found, and how exact it is.
std::string origin_text(const LabelProvenance& from) {
  const auto cancellous = from.parameters.find(kCancellousError), cortical = from.parameters.find(kCorticalError);
  char errors[120] = "its error is not known";
  if (cancellous != from.parameters.end() && cortical != from.parameters.end())
    std::snprintf(errors, sizeof errors, "standard error %.2g g/cm3 at %.3g g/cm3, %.2g at %.4g", cancellous->second,
                  imaging::kCancellous_g_cm3, cortical->second, imaging::kCortical_g_cm3);
  return "           " + from.method + "; " + errors + "\n";
}

// Segmented bones and meshes have no Hounsfield units.
std::string density_text(const CaseInfo& info) {
  if (info.calibration == DensityCalibration{}) return "density    given with the shape\n";
  char threshold[60] = "none; bones come from a label map";
  const auto by_map = [](const CaseLabel& label) { return label.provenance.method.starts_with("label map"); };
  if (std::ranges::none_of(info.labels, by_map))
    std::snprintf(threshold, sizeof threshold, "%.6g HU", info.threshold_hu);
  char text[160];
  std::snprintf(text, sizeof text, "threshold  %s\ndensity    %.6g + %.6g HU g/cm3\n", threshold,
                info.calibration.intercept_g_cm3, info.calibration.slope_g_cm3_per_hu);
  return text + (info.density_from ? origin_text(*info.density_from) : "");
}

std::string point_text(const Vec3& v) {
  char text[100];
  std::snprintf(text, sizeof text, "  %.6g %.6g %.6g", v.x(), v.y(), v.z());
  return text;
}

// "label      1  bone 1 (bone): threshold, islands; threshold_hu 226"
std::string label_lines(const char* title, const std::vector<CaseLabel>& labels) {
  std::string text;
  for (const CaseLabel& label : labels) {
    text += title + std::to_string(label.value) + "  " + label.name + " (" + std::string(name_of(label.kind)) +
            "): " + label.provenance.method;
    for (const auto& [name, value] : label.provenance.parameters) {
      char number[32];
      std::snprintf(number, sizeof number, " %.6g", value);
      text += "; " + name + number;
    }
    if (!label.provenance.edits.empty()) text += "; edits " + std::to_string(label.provenance.edits.size());
    text += "\n";
  }
  return text;
}

std::string scan_text(const CaseInfo& info) {
  if (!info.scan) return "";
  const ScanGeometry& g = info.scan->geometry;
  char text[160];
  std::snprintf(text, sizeof text, "scan       %dx%dx%d, %.3gx%.3gx%.3g mm\n", g.dims[0], g.dims[1], g.dims[2],
                g.axes_mm.col(0).norm(), g.axes_mm.col(1).norm(), g.axes_mm.col(2).norm());
  return text + label_lines("label      ", info.labels) + label_lines("tissue     ", info.tissues);
}

// Points in mm, directions as unit vectors; LPS.
std::string plan_text(const CaseInfo& info) {
  std::string text;
  for (const Landmark& l : info.landmarks) text += "landmark   " + l.name + point_text(l.point_mm) + "\n";
  for (const PlannedAxis& a : info.axes)
    text += "axis       " + a.name + point_text(a.point_mm) + " along" + point_text(a.direction) + "\n";
  for (const PlannedPlane& p : info.planes)
    text += "plane      " + p.name + point_text(p.point_mm) + " normal" + point_text(p.normal) + "\n";
  for (const PlannedRegion& r : info.regions)
    text +=
        "region     " + r.name +
        (r.label != 0 ? "  label " + std::to_string(r.label) : point_text(r.min_mm) + " to" + point_text(r.max_mm)) +
        "\n";
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
  return "title      " + info.title + "\nsource     " + info.source + "\n" + text + scan_text(info) + plan_text(info) +
         "hash       " + to_hex(bone.hash()) + "\n";
}

std::string report_json(const Case& bone) {
  const CaseInfo& info = bone.info();
  const Box box = bone.bounds();
  const auto list = [](const Vec3& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); };
  nlohmann::json report{{"schema_version", info.schema_version},
                        {"title", info.title},
                        {"source", info.source},
                        {"pitch_mm", info.pitch_mm},
                        {"threshold_hu", info.threshold_hu},
                        {"bounds_mm", {{"min", list(box.min_mm)}, {"max", list(box.max_mm)}}},
                        {"bone_volume_mm3", bone.volume_mm3()},
                        {"hash", to_hex(bone.hash())}};
  // As in case.json.
  const auto described = nlohmann::json::parse(to_text({info, bone.hash()}));
  report["calibration"] = described["calibration"];
  for (const char* part : {"scan", "labels", "tissues", "landmarks", "axes", "planes", "regions"})
    if (described.contains(part)) report[part] = described[part];
  return report.dump(2) + "\n";
}

}  // namespace osteon::import
