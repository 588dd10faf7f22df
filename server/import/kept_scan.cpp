#include "server/import/kept_scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <string>

#include "common/core/bounded_text.hpp"
#include "common/field/tissue.hpp"
#include "common/imaging/bone_markers.hpp"
#include "common/imaging/calibration.hpp"

namespace osteon::import {
namespace {

constexpr int kMostBoneNumbers = 255;  // more islands share the last number, see number_bones()

std::uint8_t tissue_of(const DensityCalibration& calibration, std::int16_t hu) {
  const auto density = static_cast<float>(imaging::bone_density_g_cm3(calibration, hu));
  return static_cast<std::uint8_t>(density >= kCorticalFrom_g_cm3 ? Tissue::cortical : Tissue::trabecular);
}

// Replaces the threshold by the regions that grew from seeds.
void add_growing(const GrowOptions& grow, LabelProvenance& provenance) {
  const char* takes = !grow.similar_hu ? "at or above the threshold"
                      : grow.adaptive  ? "similar to the mean of the region"
                                       : "similar to the seed";
  provenance.method = std::string("region growing by ") + (grow.by == imaging::GrowBy::slice ? "slice" : "volume") +
                      ", " + takes + provenance.method.substr(std::strlen("threshold"));
  if (grow.similar_hu) provenance.parameters["similar_hu"] = *grow.similar_hu;
  for (std::size_t i = 0; i < grow.seeds_mm.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      provenance.parameters["seed_" + std::to_string(i + 1) + "_" + "xyz"[axis] + "_mm"] = grow.seeds_mm[i][axis];
}

// Which island became the bone, what it is if it is no bone, and how much of each kind was left out as no bone.
void add_island(const CtSegmentation& found, int bone, LabelProvenance& provenance) {
  const int island = found.kept[static_cast<std::size_t>(bone - 1)];
  provenance.parameters["island"] = island;
  if (static_cast<std::size_t>(island) > found.natures.size()) return;
  const imaging::IslandKind kind = found.natures[static_cast<std::size_t>(island - 1)].kind;
  provenance.method += kind == imaging::IslandKind::bone ? "" : ", " + likeness_of(kind);
}
void add_not_bone(const CtSegmentation& found, LabelProvenance& provenance) {
  for (const NotBone& of : not_bone(found))
    if (!of.kept) provenance.parameters["left_out_" + std::string(name_of(of.kind)) + "_cm3"] = of.volume_cm3;
}

// The parameters of the watershed that separated the bones, and which seeds stand for a bone.
void add_separation(const CtOptions& options, int bone, LabelProvenance& provenance) {
  if (options.grow.seeds_mm.empty()) {
    provenance.method += ", watershed from cores";
    provenance.parameters["neck"] = imaging::kNeck;
    provenance.parameters["least_core_mm"] = imaging::kLeastCore_mm;
    return;
  }
  provenance.method += ", watershed from seeds";
  int own = 0;
  for (std::size_t i = 0; i < options.grow.seeds_mm.size(); ++i)
    if ((options.grow.bones.empty() ? static_cast<int>(i) + 1 : options.grow.bones[i]) == bone)
      provenance.parameters["own_seed_" + std::to_string(++own)] = static_cast<double>(i) + 1;
}

CaseLabel label_of(const CtOptions& options, const CtSegmentation& found, const FoundBone& bone,
                   LabelProvenance provenance) {
  CaseLabel label{bone.number, "bone " + std::to_string(bone.number), LabelKind::bone, std::move(provenance)};
  add_not_bone(found, label.provenance);
  if (!bone.segmented)
    label.provenance = {"edits", {}, {}};
  else if (found.separated)
    add_separation(options, bone.number, label.provenance);
  else if (!found.merged && bone.number < kMostBoneNumbers)
    add_island(found, bone.number, label.provenance);
  label.provenance.edits = bone.edits;
  name_label(options.edits, label);
  return label;
}

// How every label of the scan was found.
LabelProvenance provenance_of(const CtOptions& options) {
  LabelProvenance provenance;
  provenance.method = options.hollow ? "threshold, islands" : "threshold, enclosed marrow, islands";
  provenance.parameters["threshold_hu"] = options.threshold_hu;
  if (options.surface == SurfaceAt::half_maximum) provenance.method += ", surface at half maximum";
  if (!options.grow.seeds_mm.empty()) add_growing(options.grow, provenance);
  if (options.median) provenance.parameters["median_voxels"] = *options.median == imaging::MedianBox::slice ? 9 : 27;
  if (options.gaussian_mm > 0.0) provenance.parameters["gaussian_mm"] = options.gaussian_mm;
  if (const auto box = std::ranges::find(options.edits, EditKind::box, &LabelEdit::kind); box != options.edits.end())
    for (std::size_t corner = 0; corner < box->points_mm.size(); ++corner)
      for (int axis = 0; axis < 3; ++axis)
        provenance.parameters["box_" + std::to_string(corner + 1) + "_" + "xyz"[axis] + "_mm"] =
            box->points_mm[corner][axis];
  return provenance;
}

void list_tissues(const CaseScan& scan, double metal_hu, CaseInfo& info) {
  const CaseLabel known[] = {
      {static_cast<int>(Tissue::cortical),
       "cortical",
       LabelKind::cortical,
       {"density", {{"from_g_cm3", static_cast<double>(kCorticalFrom_g_cm3)}}, {}}},
      {static_cast<int>(Tissue::trabecular),
       "cancellous",
       LabelKind::cancellous,
       {"density", {{"below_g_cm3", static_cast<double>(kCorticalFrom_g_cm3)}}, {}}},
      {static_cast<int>(Tissue::metal), "metal", LabelKind::metal, {"HU", {{"from_hu", metal_hu}}, {}}},
      {static_cast<int>(Tissue::enamel),
       "enamel",
       LabelKind::enamel,
       {"density", {{"above_g_cm3", imaging::kCompactBone_g_cm3}}, {}}},
  };
  for (const CaseLabel& label : known)
    if (std::ranges::count(scan.tissue.values(), static_cast<std::uint8_t>(label.value)) != 0)
      info.tissues.push_back(label);
}

}  // namespace

imaging::VoxelBox kept_voxels(const imaging::HuVolume& volume, const std::array<int, 3>& first,
                              const std::array<int, 3>& last, double margin_mm) {
  imaging::VoxelBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int margin = static_cast<int>(std::ceil(margin_mm / volume.spacing_mm[static_cast<int>(axis)]));
    box.first[axis] = std::max(0, first[axis] - margin);
    box.last[axis] = std::min(volume.dims[axis] - 1, last[axis] + margin);
  }
  return box;
}

Result<CaseScan> kept_scan(imaging::HuVolume volume, KnownVoxels known, const imaging::VoxelBox& box,
                           const DensityCalibration& calibration, const KeepGoing& keep_going) {
  CaseScan scan;
  for (std::size_t axis = 0; axis < 3; ++axis) scan.geometry.dims[axis] = box.dim(axis);
  scan.geometry.origin_mm = volume.position_mm(Vec3(box.first[0], box.first[1], box.first[2]));
  scan.geometry.axes_mm = volume.directions * volume.spacing_mm.asDiagonal();
  auto hu = imaging::cropped(std::move(volume), box.first, box.last, part(keep_going, 0.0, 0.4));
  if (!hu) return tl::unexpected(hu.error());
  scan.hu = std::move(hu->values);
  std::size_t to = 0;
  for (int slice = box.first[2]; slice <= box.last[2]; ++slice) {
    if (!keep_going(0.4 + 0.6 * (slice - box.first[2]) / box.dim(2))) return stopped_while("taking labels and tissues");
    for (int row = box.first[1]; row <= box.last[1]; ++row)
      for (int column = box.first[0]; column <= box.last[0]; ++column, ++to) {
        const std::uint8_t label = known.labels.at(column, row, slice);
        const std::uint8_t hard = known.tissue.values.empty() ? std::uint8_t{0} : known.tissue.at(column, row, slice);
        scan.labels.push_back(label);
        scan.tissue.push_back(!known.bone_labels[label] ? std::uint8_t{0}
                              : hard != 0               ? hard
                                                        : tissue_of(calibration, scan.hu[to]));
      }
  }
  return scan;
}

void name_label(std::span<const LabelEdit> edits, CaseLabel& label) {
  for (const LabelEdit& edit : edits) {
    if (edit.kind != EditKind::label || edit.bone != label.value) continue;
    label.name = edit.name;
    label.provenance.parameters["minutes"] = edit.minutes;
  }
}

void list_labels(const CaseScan& scan, const CtOptions& options, const CtSegmentation& found, CaseInfo& info) {
  for (const FoundBone& bone : found.bones)
    info.labels.push_back(label_of(options, found, bone, provenance_of(options)));
  if (!found.bones.empty()) return list_tissues(scan, options.metal_hu, info);
  const int bones = found.merged ? 1 : std::min(kMostBoneNumbers, static_cast<int>(found.kept.size()));
  for (int bone = 1; bone <= bones; ++bone) {
    CaseLabel label{bone, "bone " + std::to_string(bone), LabelKind::bone, provenance_of(options)};
    add_not_bone(found, label.provenance);
    if (!found.merged) add_island(found, bone, label.provenance);
    info.labels.push_back(std::move(label));
  }
  list_tissues(scan, options.metal_hu, info);
}

void list_labels(const CaseScan& scan, const PlacedLabels& placed, const CtOptions& options, CaseInfo& info) {
  info.labels = placed.labels;
  list_tissues(scan, options.metal_hu, info);
  // Tissue that the label map names is not found by its density.
  for (CaseLabel& tissue : info.tissues)
    if (std::ranges::find(info.labels, tissue.kind, &CaseLabel::kind) != info.labels.end())
      tissue.provenance.method += ", or as its label says";
}

Result<CaseScan> kept_scan(const imaging::LabelVolume& volume, const KeepGoing& keep_going) {
  const CoordBox& box = volume.labels.box;
  CaseScan scan;
  scan.geometry.dims = {box.dims().x, box.dims().y, box.dims().z};
  scan.geometry.origin_mm = position_mm(box.min, 1.0).cwiseProduct(volume.spacing_mm);
  scan.geometry.axes_mm = volume.spacing_mm.asDiagonal();
  for (int z = box.min.z; z <= box.max.z; ++z) {
    if (!keep_going(static_cast<double>(z - box.min.z) / box.dims().z)) return stopped_while("taking the labels");
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int x = box.min.x; x <= box.max.x; ++x) scan.labels.push_back(volume.labels.at({x, y, z}));
  }
  return scan;
}

void list_labels(const LabelLegend& legend, CaseInfo& info) {
  constexpr std::size_t kMostNameBytes = kMostCaseTextBytes - 20;  // a number may follow
  std::set<std::string> taken;
  for (const BoneColour& colour : legend.bones) {
    CaseLabel label;
    label.value = static_cast<int>(info.labels.size()) + 1;
    const std::string given = colour.name.empty() ? "bone" : bounded_text(colour.name, kMostNameBytes);
    label.name = given;
    for (int n = 2; !taken.insert(label.name).second; ++n) label.name = given + " " + std::to_string(n);
    label.provenance.method = "colour of the slices";
    label.provenance.parameters = {{"red", colour.rgb[0]},
                                   {"green", colour.rgb[1]},
                                   {"blue", colour.rgb[2]},
                                   {"tolerance", legend.tolerance},
                                   {"density_g_cm3", colour.density_g_cm3}};
    info.labels.push_back(std::move(label));
  }
}

}  // namespace osteon::import
