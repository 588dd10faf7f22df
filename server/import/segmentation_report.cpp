#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/import/ct_import.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kMostListed = 40;
constexpr double kDifference = 0.05;       // between voxels and case; larger ones are reported
constexpr double kLeastListed_cm3 = 0.05;  // smaller islands are summed up

template <class... Values>
std::string line(const char* format, Values... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// For each island, in the order of the list.
std::vector<bool> kept_flags(const CtSegmentation& found) {
  std::vector<bool> kept(found.islands.size(), false);
  for (const int number : found.kept) kept[static_cast<std::size_t>(number - 1)] = true;
  return kept;
}

// Why an island is of a kind.
std::string why_of(imaging::IslandKind kind, const CtSegmentation& found) {
  switch (kind) {
    case imaging::IslandKind::table:
      return "thin and long, in the air beside the patient";
    case imaging::IslandKind::cast:
      return "a thin shell in the air around bone";
    case imaging::IslandKind::metal:
      return line("most of it reaches %.0f HU", found.metal_hu);
    case imaging::IslandKind::contrast:
      if (!found.contrast) break;
      return line("blood of %.0f HU with noise of %.0f HU over %.1f cm3, with no bone around it",
                  found.contrast->level_hu, found.contrast->noise_hu, found.contrast->homogeneous_cm3);
    case imaging::IslandKind::bone:
      break;
  }
  return "";
}

// "island 3", or "islands 2, 3"; of very many the first ones.
std::string numbers_text(const std::vector<int>& islands) {
  constexpr std::size_t kMostNumbers = 12;
  std::string text = islands.size() == 1 ? "island" : "islands";
  for (std::size_t i = 0; i < std::min(islands.size(), kMostNumbers); ++i)
    text += (i == 0 ? " " : ", ") + std::to_string(islands[i]);
  if (islands.size() > kMostNumbers) text += line(" and %zu more", islands.size() - kMostNumbers);
  return text;
}

// What was named as no bone, and whether it is kept.
std::string not_bone_text(const CtSegmentation& found) {
  std::string text;
  for (const NotBone& of : not_bone(found)) text += (text.empty() ? "not bone   " : "           ") + of.text + "\n";
  return text;
}

// How much was kept, and how to keep more.
std::string kept_text(const CtSegmentation& found, double kept_cm3, double all_cm3) {
  const std::size_t left_out = found.islands.size() - found.kept.size();
  if (left_out == 0)
    return line(found.regions.empty() ? "kept       all %.2f cm3; nothing was left out\n"
                                      : "kept       all %.2f cm3 that grew from the seeds\n",
                kept_cm3);
  return line(
      "kept       %.2f of %.2f cm3; %zu %s with %.2f cm3 (%.0f %%) left out\n"
      "           --keep N,M takes islands by number, --keep all takes every one\n",
      kept_cm3, all_cm3, left_out, left_out == 1 ? "island" : "islands", found.left_out_cm3,
      100.0 * found.left_out_cm3 / all_cm3);
}

// The bones after separation and edits, and the edits.
std::string bones_text(const CtSegmentation& found) {
  std::string text = line("bones      %zu in the case%s\n", found.bones.size(),
                          found.separated ? ", separated where the bone between them is thinnest" : "");
  for (const FoundBone& bone : found.bones) text += line("           %6d  %7.2f cm3\n", bone.number, bone.volume_cm3);
  return text + edits_text(found);
}

// Marrow, blur, metal and enamel within the kept islands, of `kept_cm3`, and what became of their volume.
std::string parts_text(const CtSegmentation& found, double kept_cm3) {
  std::string text;
  if (found.marrow_cm3 > 0.0)
    text += line(
        "marrow     %.2f cm3 of that is below the threshold, enclosed by bone or between it; --hollow leaves it out\n",
        found.marrow_cm3);
  if (found.blur_cm3 > 0.0)
    text += line(
        "surface    at half maximum: %.2f cm3 of that is blur outside of it; --surface threshold takes it as bone\n",
        found.blur_cm3);
  if (found.joined_cm3.size() > 1) {
    std::string pieces;
    for (std::size_t i = 0; i < found.joined_cm3.size(); ++i)
      pieces += line(i == 0 ? "%.2f" : " and %.2f", found.joined_cm3[i]);
    text += "joined     by marrow alone: pieces with " + pieces +
            " cm3 of denser bone, as at a narrow fracture; --hollow separates them\n";
  }
  const double bone_cm3 = kept_cm3 - found.blur_cm3;
  if (found.case_cm3 > 0.0 && std::abs(found.case_cm3 - bone_cm3) > kDifference * bone_cm3)
    text += line(
        "case       %.2f cm3, %+.0f %% of the voxels kept\n"
        "           walls about as thin as a voxel, noise, or a coarse --pitch do that\n",
        found.case_cm3, 100.0 * (found.case_cm3 - bone_cm3) / bone_cm3);
  if (found.metal_cm3 > 0.0)
    text += line("metal      %.3f cm3 at or around %.0f HU and above: it is shown as metal, and no tool cuts it\n",
                 found.metal_cm3, found.metal_hu);
  if (found.enamel_cm3 > 0.0)
    text += line("enamel     %.3f cm3, or mineral as dense: shown as enamel, cut like compact bone of %.1f g/cm3\n",
                 found.enamel_cm3, imaging::kCompactBone_g_cm3);
  return text;
}

}  // namespace

std::string place_words(const Vec3& at, const Box& box) {
  static constexpr const char* kWords[3][2] = {{"right", "left"}, {"front", "back"}, {"foot end", "head end"}};
  std::string words;
  for (int axis = 0; axis < 3; ++axis) {
    const double part = (at[axis] - box.min_mm[axis]) / std::max(1e-9, box.size_mm()[axis]);
    if (part > 1.0 / 3.0 && part < 2.0 / 3.0) continue;
    words += (words.empty() ? "" : ", ") + std::string(kWords[axis][part < 0.5 ? 0 : 1]);
  }
  return words.empty() ? "middle" : words;
}

std::string words_of(imaging::IslandKind kind) {
  if (kind == imaging::IslandKind::contrast) return "contrast medium";
  return kind == imaging::IslandKind::table ? "table or headrest" : std::string(name_of(kind));
}

std::string likeness_of(imaging::IslandKind kind) {
  const bool by_hu = kind == imaging::IslandKind::metal || kind == imaging::IslandKind::contrast;
  return (by_hu ? "its HU are those of " : "its shape is that of a ") + words_of(kind);
}

std::vector<NotBone> not_bone(const CtSegmentation& found) {
  std::vector<NotBone> all;
  const std::vector<bool> is_kept = kept_flags(found);
  using enum imaging::IslandKind;
  for (const auto kind : {table, cast, metal, contrast})
    for (const bool kept : {false, true}) {
      NotBone of{.kind = kind, .kept = kept};
      for (std::size_t i = 0; i < found.natures.size(); ++i) {
        if (found.natures[i].kind != kind || is_kept[i] != kept) continue;
        of.islands.push_back(static_cast<int>(i + 1));
        of.volume_cm3 += found.islands[i].volume_cm3;
      }
      if (of.islands.empty()) continue;
      of.text = line("%s, %s, %.2f cm3%s: ", words_of(kind).c_str(), numbers_text(of.islands).c_str(), of.volume_cm3,
                     kept                 ? ", kept"
                     : found.kept.empty() ? ""
                                          : ", left out") +
                why_of(kind, found);
      all.push_back(std::move(of));
    }
  return all;
}

std::string edits_text(const CtSegmentation& found) {
  std::string text;
  for (std::size_t i = 0; i < found.edits.size(); ++i)
    text += line("%s %6zu  %s\n", i == 0 ? "edits     " : "          ", i + 1, found.edits[i].c_str());
  return text;
}

std::string segmentation_text(const CtSegmentation& found) {
  std::string text;
  double kept_cm3 = 0.0, others_cm3 = 0.0, all_cm3 = 0.0, largest_other_cm3 = 0.0;
  std::size_t listed = 0, others = 0;
  if (!found.threshold_reason.empty()) text += "suggested  " + found.threshold_reason + "\n";
  for (std::size_t i = 0; i < found.regions.size(); ++i) {
    const imaging::Region& region = found.regions[i];
    text += line("%s %6zu  %lld voxels from %.0f to %.0f HU\n", i == 0 ? "grown     " : "          ", i + 1,
                 static_cast<long long>(region.voxels), region.low_hu, region.high_hu);
  }
  text += "islands    number     cm3   g/cm3       centre, mm (LPS)        kind\n";
  const std::vector<bool> is_kept = kept_flags(found);
  for (std::size_t i = 0; i < found.islands.size(); ++i) {
    const imaging::Island& island = found.islands[i];
    const bool kept = is_kept[i];
    all_cm3 += island.volume_cm3;
    if (kept) kept_cm3 += island.volume_cm3;
    if (listed >= kMostListed || (listed > 0 && island.volume_cm3 < kLeastListed_cm3)) {
      ++others;
      others_cm3 += island.volume_cm3;
      largest_other_cm3 = std::max(largest_other_cm3, island.volume_cm3);
      continue;
    }
    ++listed;
    text += line("           %6zu  %7.2f  %6.2f  %8.1f %8.1f %8.1f  %-5s  %-4s  %s\n", i + 1, island.volume_cm3,
                 island.density_g_cm3, island.centre_mm.x(), island.centre_mm.y(), island.centre_mm.z(),
                 i < found.natures.size() ? name_of(found.natures[i].kind).data() : "bone", kept ? "kept" : "",
                 place_words(island.centre_mm, found.region).c_str());
  }
  if (others > 0)
    text += line("           and %zu more of at most %.2f cm3 each, %.2f cm3 together\n", others, largest_other_cm3,
                 others_cm3);
  if (found.kept.empty()) return text + not_bone_text(found);
  text += kept_text(found, kept_cm3, all_cm3) + not_bone_text(found);
  if (!found.bones.empty())
    text += bones_text(found);
  else if (found.kept.size() > 1)
    text += found.merged ? "bones      1 in the case, of all kept islands\n"
                         : line("bones      %zu in the case, one for each kept island\n", found.kept.size());
  return text + parts_text(found, kept_cm3);
}

}  // namespace osteon::import
