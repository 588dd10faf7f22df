#include "server/import/report_facts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "common/field/tissue.hpp"
#include "common/imaging/calibration.hpp"
#include "common/imaging/threshold.hpp"
#include "server/import/label_views.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kMostParts = 40;      // listed; smaller islands are summed up
constexpr double kLeastPart_cm3 = 0.05;     // of an island that is listed, unless it is kept or the largest
constexpr double kMostChange = 0.05;        // between voxels and case; larger ones are a warning
constexpr double kThickSlices_mm = 2.0;     // [A] From here on the report warns
constexpr double kLeastShown_cm3 = 0.0005;  // less is shown as 0.00

template <class... Values>
std::string sentence(const char* format, Values... values) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

// Sums over the voxels of one label.
struct LabelSums {
  std::int64_t voxels = 0;
  double density = 0.0;
  Vec3 at = Vec3::Zero();  // voxel coordinates
};

struct ScanSums {
  std::array<LabelSums, 256> of_label;
  std::array<std::int64_t, 256> of_tissue{};    // voxels of bone
  std::array<std::array<bool, 2>, 3> at_end{};  // bone lies in the outer voxels of the case's scan: axis, first or last
};

Result<ScanSums> sums_of(const CaseScan& scan, const CaseInfo& info, HuHistogram& of_bone,
                         const KeepGoing& keep_going) {
  ScanSums sums;
  std::array<bool, 256> carved{};
  for (const CaseLabel& label : info.labels) carved[static_cast<std::size_t>(label.value)] = is_carved(label.kind);
  const std::array<int, 3>& dims = scan.geometry.dims;
  std::size_t i = 0;
  for (int slice = 0; slice < dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / dims[2])) return stopped_while("writing the report");
    for (int row = 0; row < dims[1]; ++row)
      for (int column = 0; column < dims[0]; ++column, ++i) {
        const std::uint8_t label = scan.labels[i];
        if (label == 0) continue;
        LabelSums& to = sums.of_label[label];
        ++to.voxels;
        to.at += Vec3(column, row, slice);
        if (!carved[label]) continue;
        if (!scan.tissue.empty()) ++sums.of_tissue[scan.tissue[i]];
        if (!scan.hu.empty()) {
          to.density += imaging::bone_density_g_cm3(info.calibration, scan.hu[i]);
          of_bone.add(scan.hu[i], 1);
        }
        const std::array<int, 3> at{column, row, slice};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          sums.at_end[axis][0] = sums.at_end[axis][0] || at[axis] == 0;
          sums.at_end[axis][1] = sums.at_end[axis][1] || at[axis] == dims[axis] - 1;
        }
      }
  }
  return sums;
}

std::optional<double> density_of(const CaseLabel& label, const LabelSums& sums, const CaseScan& scan) {
  if (!is_carved(label.kind)) return {};
  if (!scan.hu.empty())
    return sums.voxels > 0 ? std::optional(sums.density / static_cast<double>(sums.voxels)) : std::nullopt;
  const auto given = label.provenance.parameters.find("density_g_cm3");
  return given == label.provenance.parameters.end() ? std::nullopt : std::optional(given->second);
}

Box box_of(const ScanGeometry& g) {
  Box box;
  for (int corner = 0; corner < 8; ++corner)
    box.include(g.position_mm(Vec3((corner & 1) != 0 ? g.dims[0] - 1 : 0, (corner & 2) != 0 ? g.dims[1] - 1 : 0,
                                   (corner & 4) != 0 ? g.dims[2] - 1 : 0)));
  return box;
}

void list_labelled(const ImportReport& report, const ScanSums& sums, ReportFacts& facts) {
  const CaseScan& scan = *report.scan;
  const double voxel_cm3 = std::abs(scan.geometry.axes_mm.determinant()) * 1e-3;
  const Box whole = box_of(report.read.value_or(scan.geometry));
  int colour = 0;
  for (const CaseLabel& label : report.bone->info().labels) {
    const LabelSums& of = sums.of_label[static_cast<std::size_t>(label.value)];
    ReportPart part;
    part.number = label.value;
    part.name = label.name;
    part.kind = name_of(label.kind);
    part.kept = true;
    part.at_risk = !is_carved(label.kind);
    part.volume_cm3 = static_cast<double>(of.voxels) * voxel_cm3;
    part.density_g_cm3 = density_of(label, of, scan);
    if (of.voxels > 0) part.centre_mm = scan.geometry.position_mm(of.at / static_cast<double>(of.voxels));
    part.place = place_words(part.centre_mm, whole);
    part.colour = palette_colour(colour++);
    facts.parts.push_back(std::move(part));
  }
}

void list_islands(const CtSegmentation& found, ReportFacts& facts) {
  // Islands that are not in the list: those of the case, and others.
  std::array<std::size_t, 2> more{};
  std::array<double, 2> more_cm3{};
  double all_cm3 = 0.0;
  for (std::size_t i = 0; i < found.islands.size(); ++i) {
    const imaging::Island& island = found.islands[i];
    const int number = static_cast<int>(i + 1);
    const auto at = std::ranges::find(found.kept, number);
    const bool kept = at != found.kept.end();
    all_cm3 += island.volume_cm3;
    if (facts.parts.size() >= kMostParts || (!kept && i > 0 && island.volume_cm3 < kLeastPart_cm3)) {
      ++more[kept ? 0 : 1];
      more_cm3[kept ? 0 : 1] += island.volume_cm3;
      continue;
    }
    ReportPart part;
    part.number = number;
    part.kept = kept;
    part.volume_cm3 = island.volume_cm3;
    part.density_g_cm3 = island.density_g_cm3;
    part.centre_mm = island.centre_mm;
    part.place = place_words(island.centre_mm, found.region);
    if (i < found.natures.size()) part.island = found.natures[i];
    if (kept) {
      const int bone = found.merged ? 1 : std::min(255, static_cast<int>(at - found.kept.begin()) + 1);
      part.name = "bone " + std::to_string(bone);
      part.kind = name_of(LabelKind::bone);
      part.colour = palette_colour(bone - 1);
    }
    if (i < found.views.each.size()) part.picture = found.views.each[i];
    facts.parts.push_back(std::move(part));
  }
  for (const std::size_t which : {0U, 1U})
    if (more[which] > 0)
      facts.unlisted.push_back(sentence("%zu more %s with %.2f cm³ together%s.", more[which],
                                        more[which] == 1 ? "island" : "islands", more_cm3[which],
                                        which == 0 ? " are in the case" : " were found"));
  if (found.kept.empty()) return;
  std::size_t left_out = found.islands.size() - found.kept.size();
  double left_out_cm3 = found.left_out_cm3;
  for (const NotBone& of : not_bone(found)) {
    if (of.kept) continue;
    facts.left_out.push_back("Not bone: " + of.text + ".");
    left_out -= of.islands.size();
    left_out_cm3 -= of.volume_cm3;
  }
  if (left_out > 0)
    facts.left_out.push_back(sentence("%zu of %zu islands, %.2f of %.2f cm³ (%.0f %%): not chosen.", left_out,
                                      found.islands.size(), left_out_cm3, all_cm3, 100.0 * left_out_cm3 / all_cm3));
  if (found.blur_cm3 > 0.0)
    facts.left_out.push_back(
        sentence("%.2f cm³ of the kept islands: blur, outside the half maximum of their surface.", found.blur_cm3));
}

// The ends of the scan at which its bone is cut off, in words.
std::string cut_ends(const ImportReport& report, const ScanSums& sums) {
  if (!report.read) return "";
  static constexpr const char* kSides[3][2] = {{"right", "left"}, {"front", "back"}, {"foot end", "head end"}};
  const ScanGeometry &whole = *report.read, &kept = report.scan->geometry;
  const Vec3 offset = whole.axes_mm.inverse() * (kept.origin_mm - whole.origin_mm);
  std::set<std::string> sides;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const auto first = static_cast<int>(std::lround(offset[axis]));
    int main = 0;  // the patient's axis along which the scan's one lies most
    const Vec3 along = whole.axes_mm.col(axis);
    along.cwiseAbs().maxCoeff(&main);
    const int up = along[main] > 0.0 ? 1 : 0;
    if (sums.at_end[a][0] && first == 0) sides.insert(kSides[main][1 - up]);
    if (sums.at_end[a][1] && first + kept.dims[a] == whole.dims[a]) sides.insert(kSides[main][up]);
  }
  std::string words;
  for (const std::string& side : sides) words += (words.empty() ? "" : ", ") + side;
  return words;
}

void add_scan_warnings(const ImportReport& report, std::vector<std::string>& warnings) {
  if (report.series && report.series->without_number > 0) warnings.push_back(without_number_text(*report.series) + ".");
  if (report.series)
    for (const SeriesEntry& entry : report.series->series)
      if (entry.number == report.series->taken && entry.lossy > 0)
        warnings.push_back(sentence("%d of %d slices were compressed with loss: their HU differ from the scanner's.",
                                    entry.lossy, entry.slices));
  if (report.read) {
    const double thickest_mm = report.read->axes_mm.colwise().norm().maxCoeff();
    if (thickest_mm >= kThickSlices_mm)
      warnings.push_back(
          sentence("Slices are %.3g mm apart: thin walls may have holes, and narrow gaps may be closed.", thickest_mm));
  }
}

void add_bone_warnings(const ImportReport& report, const ScanSums& sums, ReportFacts& facts) {
  std::vector<std::string>& warnings = facts.warnings;
  if (const std::string ends = cut_ends(report, sums); !ends.empty())
    warnings.push_back("The scan ends within the bone (" + ends + "): there it has a flat end.");
  if (facts.metal_cm3 > kLeastShown_cm3)
    warnings.push_back(
        sentence("%.2f cm³ of metal: no tool cuts it, and streaks around it may look like bone.", facts.metal_cm3));
  if (report.labels) {
    if (!report.labels->oriented)
      warnings.emplace_back("The label map does not say how it lies in the patient: left and right may be swapped.");
    if (report.labels->beyond_cm3 > 0.0)
      warnings.push_back(sentence("%.2f cm³ of labels lie where the CT has ended.", report.labels->beyond_cm3));
    return;
  }
  if (!report.islands) return;
  const CtSegmentation& found = *report.islands;
  if (found.joined_cm3.size() > 1) {
    std::string pieces;
    for (std::size_t i = 0; i < found.joined_cm3.size(); ++i)
      pieces += sentence(i == 0 ? "%.2f" : " and %.2f", found.joined_cm3[i]);
    warnings.push_back("Marrow alone joins pieces with " + pieces +
                       " cm³ of denser bone, as at a narrow fracture; --hollow separates them.");
  }
  double kept_cm3 = -found.blur_cm3;
  for (const int number : found.kept) kept_cm3 += found.islands[static_cast<std::size_t>(number - 1)].volume_cm3;
  if (found.case_cm3 > 0.0 && std::abs(found.case_cm3 - kept_cm3) > kMostChange * kept_cm3)
    warnings.push_back(
        sentence("The bone has %.2f cm³, %+.0f %% of its voxels': walls about as thin as a voxel, noise, "
                 "or a coarse --pitch do that.",
                 found.case_cm3, 100.0 * (found.case_cm3 - kept_cm3) / kept_cm3));
}

void add_read_step(const ImportReport& report, ReportFacts& facts) {
  ReportStep step{"read the scan", facts.source, {}};
  if (report.series)
    for (const SeriesEntry& entry : report.series->series) {
      if (entry.number != report.series->taken) continue;
      step.parameters["slices"] = entry.slices;
      if (entry.resampled > 0) {
        step.text += "; " + entry.irregularity + ", resampled";
        step.parameters["resampled_slices"] = entry.resampled;
      }
      if (entry.doubled > 0) step.parameters["doubled_slices_left_out"] = entry.doubled;
    }
  facts.steps.push_back(std::move(step));
}

void add_steps(const ImportReport& report, ReportFacts& facts) {
  add_read_step(report, facts);
  if (report.options) {
    if (report.options->median)
      facts.steps.push_back({"median filter",
                             "takes out single wrong voxels",
                             {{"voxels", *report.options->median == imaging::MedianBox::slice ? 9.0 : 27.0}}});
    if (report.options->gaussian_mm > 0.0)
      facts.steps.push_back({"Gaussian filter", "takes out noise", {{"sigma_mm", report.options->gaussian_mm}}});
  }
  if (report.islands && facts.threshold_hu) {
    const std::string& reason = report.islands->threshold_reason;
    facts.steps.push_back(
        {"threshold", reason.empty() ? "bone is at or above it" : reason, {{"threshold_hu", *facts.threshold_hu}}});
    if (const auto& contrast = report.islands->contrast)
      facts.steps.push_back({"contrast medium",
                             "blood as dense as bone is an island of its own",
                             {{"level_hu", contrast->level_hu},
                              {"noise_hu", contrast->noise_hu},
                              {"homogeneous_cm3", contrast->homogeneous_cm3},
                              {"contrast_cm3", contrast->contrast_cm3}}});
    if (report.islands->marrow_cm3 > 0.0)
      facts.steps.push_back({"marrow",
                             "below the threshold, enclosed by bone or between it, counts as bone",
                             {{"marrow_cm3", report.islands->marrow_cm3}}});
  }
  if (!report.bone) return;
  // Labels that were made in the same way are one step.
  for (const CaseLabel& label : report.bone->info().labels) {
    std::map<std::string, double> parameters = label.provenance.parameters;
    parameters.erase("number_in_file");
    parameters.erase("island");
    const bool known = std::ranges::any_of(facts.steps, [&](const ReportStep& step) {
      return step.name == "labels" && step.text == label.provenance.method && step.parameters == parameters;
    });
    if (!known) facts.steps.push_back({"labels", label.provenance.method, std::move(parameters)});
    for (const std::string& edit : label.provenance.edits) facts.steps.push_back({"edit of " + label.name, edit, {}});
  }
  const CaseInfo& info = report.bone->info();
  for (const Landmark& landmark : info.landmarks)
    facts.steps.push_back(
        {"landmark " + landmark.name,
         "in the patient (LPS)",
         {{"x_mm", landmark.point_mm.x()}, {"y_mm", landmark.point_mm.y()}, {"z_mm", landmark.point_mm.z()}}});
  facts.steps.push_back({"surface", "signed distances on cubes of this edge", {{"pitch_mm", info.pitch_mm}}});
  if (info.calibration != DensityCalibration{})
    facts.steps.push_back({"density",
                           "g/cm³ = intercept + slope · HU (Rho 1995)",
                           {{"intercept_g_cm3", info.calibration.intercept_g_cm3},
                            {"slope_g_cm3_per_hu", info.calibration.slope_g_cm3_per_hu}}});
  if (report.options)
    facts.steps.push_back({"kept scan", "around the bones", {{"margin_mm", report.options->margin_mm}}});
}

nlohmann::json list(const Vec3& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); }

template <class Value>
nlohmann::json or_null(const std::optional<Value>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

nlohmann::json json_of(const HuHistogram& histogram) {
  return {{"first_hu", HuHistogram::kFirst_hu},
          {"bin_hu", HuHistogram::kBin_hu},
          {"voxels", histogram.voxels},
          {"below", histogram.below},
          {"above", histogram.above}};
}

nlohmann::json json_of(const imaging::IslandNature& nature) {
  return {{"kind", name_of(nature.kind)},
          {"metal_share", nature.metal},
          {"at_air_share", nature.at_air},
          {"exposed_share", nature.exposed},
          {"thickness_mm", nature.thickness_mm}};
}

nlohmann::json json_of(const LabelComparison& comparison) {
  nlohmann::json labels = nlohmann::json::array();
  for (const ComparedLabel& row : comparison.labels) {
    nlohmann::json one{{"label", row.name}, {"value", row.value}, {"volume_cm3", row.volume_cm3}};
    one["truth"] = row.truth.empty() ? nlohmann::json(nullptr) : nlohmann::json(row.truth);
    if (!row.truth.empty()) {
      if (row.matched != MatchedBy::nothing) one["matched_by"] = name_of(row.matched);
      one["truth_volume_cm3"] = row.truth_cm3;
      one["dice"] = row.agreement.dice;
      one["mean_surface_distance_mm"] = or_null(row.agreement.mean_mm);
      one["surface_distance_95_mm"] = or_null(row.agreement.percentile95_mm);
    }
    labels.push_back(std::move(one));
  }
  return {{"labels", labels}, {"missing", comparison.missing}};
}

}  // namespace

void HuHistogram::add(int hu, std::int64_t count) {
  if (hu < kFirst_hu)
    below += count;
  else if (hu >= kFirst_hu + kBins * kBin_hu)
    above += count;
  else
    voxels[static_cast<std::size_t>((hu - kFirst_hu) / kBin_hu)] += count;
}

std::int64_t HuHistogram::sum() const {
  std::int64_t all = below + above;
  for (const std::int64_t count : voxels) all += count;
  return all;
}

Result<ReportFacts> report_facts(const ImportReport& report, const KeepGoing& keep_going) {
  ReportFacts facts;
  facts.title = report.bone ? report.bone->info().title : report.title;
  facts.source = report.bone ? report.bone->info().source : report.source;
  facts.scan = report.read;
  facts.has_hu = !report.histogram.empty();
  for (std::size_t i = 0; i < report.histogram.size(); ++i)
    if (report.histogram[i] > 0) facts.of_scan.add(static_cast<int>(i) + imaging::kLeastHu, report.histogram[i]);
  if (report.islands && !report.labels) facts.threshold_hu = report.islands->threshold_hu;
  add_scan_warnings(report, facts.warnings);
  if (report.islands && !report.labels) list_islands(*report.islands, facts);
  if (report.bone) {
    const auto sums = sums_of(*report.scan, report.bone->info(), facts.of_bone, keep_going);
    if (!sums) return tl::unexpected(sums.error());
    facts.bone_cm3 = report.bone->volume_mm3() * 1e-3;
    facts.pitch_mm = report.bone->pitch_mm();
    facts.hash = to_hex(report.bone->hash());
    const double voxel_cm3 = std::abs(report.scan->geometry.axes_mm.determinant()) * 1e-3;
    const auto tissue_cm3 = [&](Tissue tissue) {
      return static_cast<double>(sums->of_tissue[static_cast<std::size_t>(tissue)]) * voxel_cm3;
    };
    facts.metal_cm3 = tissue_cm3(Tissue::metal);
    facts.enamel_cm3 = tissue_cm3(Tissue::enamel);
    double density = 0.0, voxels = 0.0;
    for (const CaseLabel& label : report.bone->info().labels) {
      const LabelSums& of = sums->of_label[static_cast<std::size_t>(label.value)];
      const auto mean = density_of(label, of, *report.scan);
      if (mean) density += *mean * static_cast<double>(of.voxels), voxels += static_cast<double>(of.voxels);
    }
    if (voxels > 0.0) facts.bone_density_g_cm3 = density / voxels;
    if (facts.parts.empty()) list_labelled(report, *sums, facts);
    add_bone_warnings(report, *sums, facts);
  }
  if (report.labels)
    for (const LeftOutLabel& label : report.labels->left_out)
      facts.left_out.push_back(label.name +
                               sentence(", %.2f cm³: it is neither bone nor a structure at risk.", label.volume_cm3));
  add_steps(report, facts);
  if (report.comparison) facts.comparison = *report.comparison;
  return facts;
}

std::string to_json(const ReportFacts& facts) {
  nlohmann::json parts = nlohmann::json::array();
  for (const ReportPart& part : facts.parts) {
    parts.push_back({{"number", part.number},
                     {"name", part.name},
                     {"kind", part.kind},
                     {"kept", part.kept},
                     {"at_risk", part.at_risk},
                     {"volume_cm3", part.volume_cm3},
                     {"density_g_cm3", or_null(part.density_g_cm3)},
                     {"centre_mm", list(part.centre_mm)},
                     {"place", part.place}});
    if (part.island) parts.back()["island"] = json_of(*part.island);
  }
  nlohmann::json steps = nlohmann::json::array();
  for (const ReportStep& step : facts.steps)
    steps.push_back({{"step", step.name}, {"text", step.text}, {"parameters", step.parameters}});
  nlohmann::json json{{"title", facts.title},
                      {"source", facts.source},
                      {"threshold_hu", or_null(facts.threshold_hu)},
                      {"bone_cm3", or_null(facts.bone_cm3)},
                      {"bone_density_g_cm3", or_null(facts.bone_density_g_cm3)},
                      {"metal_cm3", facts.metal_cm3},
                      {"enamel_cm3", facts.enamel_cm3},
                      {"pitch_mm", or_null(facts.pitch_mm)},
                      {"hash", facts.hash},
                      {"parts", parts},
                      {"unlisted", facts.unlisted},
                      {"left_out", facts.left_out},
                      {"warnings", facts.warnings},
                      {"steps", steps}};
  if (facts.scan) {
    const Vec3 spacing = facts.scan->axes_mm.colwise().norm();
    json["scan"] = {{"dims", facts.scan->dims}, {"spacing_mm", list(spacing)}};
  }
  if (facts.has_hu) json["histogram"] = {{"scan", json_of(facts.of_scan)}, {"bone", json_of(facts.of_bone)}};
  if (facts.comparison) json["comparison"] = json_of(*facts.comparison);
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace osteon::import
