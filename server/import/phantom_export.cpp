#include "server/import/phantom_export.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <system_error>

#include "common/imaging/calibration.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/new_folder.hpp"
#include "server/import/label_export.hpp"

namespace osteon::import {
namespace {

constexpr double kFieldAround_mm = 8.0;  // of a scan around the bone
constexpr double kBlurReach = 5.0;       // of an edge's blur, in sigma
constexpr const char* kTruthFile = "truth.json";
constexpr const char* kTruthLabels = "labels.nii.gz";
constexpr std::uintmax_t kLongestTruth = std::uintmax_t{1} << 20;  // bytes

nlohmann::ordered_json numbers_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

BlurredHu blurred_hu(const phantoms::PhantomBone& bone, double blur_mm) {
  const auto hu = [](double density_g_cm3) { return imaging::hounsfield(imaging::kRho1995, density_g_cm3); };
  const auto around = [structures = bone.structures(), blur_mm](const Vec3& at) {
    double found = kAroundBone_hu;
    for (const phantoms::Structure& structure : structures) {
      const Box box = structure.bounds.grown(kBlurReach * blur_mm);
      if ((at.array() < box.min_mm.array()).any() || (at.array() > box.max_mm.array()).any()) continue;
      found += (structure.hu - kAroundBone_hu) * blurred_step(-structure.distance_mm(at), blur_mm);
    }
    return found;
  };
  return [&bone, blur_mm, hu, around](const Vec3& at) {
    const phantoms::BoneDepths depths = bone.depths(at);
    const double beside = around(at);
    if (depths.surface_mm > kBlurReach * blur_mm) return beside;
    const double cortical = hu(bone.cortical_g_cm3(depths.bone)), marrow = hu(bone.marrow_g_cm3(depths.bone));
    const double in_bone = blurred_step(-depths.surface_mm, blur_mm);
    const double found = beside + (cortical - beside) * in_bone;
    if (depths.cortex_mm > kBlurReach * blur_mm) return found;
    const double cancellous = hu(bone.cancellous_g_cm3(at));
    const double inner = cancellous + (marrow - cancellous) * blurred_step(-depths.marrow_mm, blur_mm);
    // Where a bone is sawn, its surface is nearer than the inner face of cortex.
    return found + (inner - cortical) * std::min(in_bone, blurred_step(-depths.cortex_mm, blur_mm));
  };
}

ScannerSettings scanner_around(const phantoms::PhantomBone& bone, ScannerSettings settings, double slice_mm) {
  const Box box = phantoms::with_structures(bone.bounds(), bone.structures()), around = box.grown(kFieldAround_mm);
  const Vec3 size = around.size_mm();
  const double tilt = std::abs(settings.tilt_degrees) * std::numbers::pi / 180.0;
  settings.centre_mm = box.centre_mm();
  settings.width_mm = size.x();
  settings.height_mm = size.y() / std::cos(tilt);
  // Tilted slices reach less far along z in front than behind. The gaps are along the slices' normal. The first and the
  // last slice lie outside a natural end, and inside the bone at a sawn end.
  const double lean_mm = 0.5 * size.y() * std::tan(tilt);
  const auto [sawn_below, sawn_above] = bone.sawn_ends();
  const double low = sawn_below ? box.min_mm.z() + lean_mm : around.min_mm.z() - lean_mm;
  const double high = sawn_above ? box.max_mm.z() - lean_mm : around.max_mm.z() + lean_mm;
  settings.centre_mm.z() = 0.5 * (low + high);
  const double slices = std::max(2.0, (high - low) * std::cos(tilt) / slice_mm);
  const double gaps = sawn_below || sawn_above ? std::floor(slices) - 1.0 : std::ceil(slices);
  settings.gaps_mm.assign(static_cast<std::size_t>(gaps), slice_mm);
  settings.thickness_mm = slice_mm;
  return settings;
}

Result<void> write_truth(const phantoms::PhantomBone& bone, const phantoms::BoneRecipe& recipe,
                         const phantoms::PhantomCase& made, const std::filesystem::path& folder,
                         const KeepGoing& keep_going) {
  const CaseInfo& info = made.bone.info();
  nlohmann::ordered_json truth{{"kind", recipe.kind},
                               {"side", phantoms::has_both_sides(recipe.kind) ? "both"
                                        : recipe.side == phantoms::Side::left ? "left"
                                                                              : "right"},
                               {"preset", recipe.preset},
                               {"condition", recipe.condition},
                               {"parameters", nlohmann::ordered_json::object()},
                               {"landmarks", nlohmann::ordered_json::object()},
                               {"axes", nlohmann::ordered_json::object()},
                               {"planes", nlohmann::ordered_json::object()},
                               {"labels", nlohmann::ordered_json::object()}};
  for (const phantoms::NamedValue& value : bone.parameters())
    truth["parameters"][std::string(value.name)] = value.value;
  for (const Landmark& landmark : info.landmarks) truth["landmarks"][landmark.name] = numbers_of(landmark.point_mm);
  for (const PlannedAxis& axis : info.axes)
    truth["axes"][axis.name] = {{"point_mm", numbers_of(axis.point_mm)}, {"direction", numbers_of(axis.direction)}};
  for (const PlannedPlane& plane : info.planes)
    truth["planes"][plane.name] = {{"point_mm", numbers_of(plane.point_mm)}, {"normal", numbers_of(plane.normal)}};
  for (const CaseLabel& label : info.labels) truth["labels"][label.name] = label.value;
  return write_new_folder(folder, [&](const std::filesystem::path& partial) -> Result<void> {
    if (auto written = write_file(partial / kTruthFile, truth.dump(1) + "\n"); !written) return written;
    return write_labels(made.scan, info.labels, partial / kTruthLabels, keep_going);
  });
}

std::map<int, std::string> names_beside(const std::filesystem::path& labels) {
  std::map<int, std::string> names;
  const std::filesystem::path file = labels.parent_path() / kTruthFile;
  std::error_code error;
  if (labels.filename() != kTruthLabels || !std::filesystem::is_regular_file(file, error) ||
      std::filesystem::file_size(file, error) > kLongestTruth)
    return names;
  const auto text = osteon::read_file(file);
  if (!text) return names;
  const auto truth = nlohmann::json::parse(*text, nullptr, false);
  if (!truth.is_object() || !truth.contains("labels") || !truth["labels"].is_object()) return names;
  for (const auto& [name, number] : truth["labels"].items())
    if (number.is_number_integer() && number >= 1 && number <= std::numeric_limits<std::uint8_t>::max())
      names.emplace(number.get<int>(), name);
  return names;
}

}  // namespace osteon::import
