// Compares the labels of a case with those that somebody else drew, voxel by voxel.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/imaging/voxel_mask.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/placed_labels.hpp"

namespace osteon::import {

// The labels to compare with, on voxels of the scan.
struct TruthLabels {
  ScanGeometry scan;                 // of all voxels of the scan
  imaging::VoxelBox box;             // the part of it with labels
  std::vector<std::uint8_t> values;  // of the box
  std::vector<CaseLabel> labels;
};

// A label map as read_label_map() and place_labels() take it. A label whose name is not known counts as bone and gets
// its number as name, so that no name of a person comes from the file. Errors: theirs.
[[nodiscard]] Result<TruthLabels> read_truth(const std::filesystem::path& input, const LabelNames& names,
                                             const imaging::HuVolume& ct, const std::string& frame_of_reference,
                                             const KeepGoing& keep_going);

// How well two sets of voxels agree. Surfaces are the voxels of a set that share a face with a voxel outside it;
// beyond the scan nothing is known, so its end makes no surface. Distances are those between the centres of voxels:
// from each voxel of one surface to the nearest one of the other, both ways.
struct Agreement {
  double dice = 0.0;  // 2 |A and B| / (|A| + |B|)
  // Absent if a set has no surface.
  std::optional<double> mean_mm;          // of all distances, both ways together (Heimann 2009)
  std::optional<double> percentile95_mm;  // 95 % of the distances of a way are at most that; the larger of both ways
};

// `a`, `b`: not 0 in the set. Both have the same dims. Errors: cancelled, internal.
[[nodiscard]] Result<Agreement> agreement_of(const imaging::VoxelMask& a, const imaging::VoxelMask& b,
                                             const Vec3& spacing_mm, const KeepGoing& keep_going);

// How a label was found in the truth.
enum class MatchedBy { nothing, name, number };
// "name" or "number"; empty for nothing.
[[nodiscard]] std::string_view name_of(MatchedBy matched);

struct ComparedLabel {
  int value = 0;                           // of the case's label; 0: several labels
  std::string name;                        // of the case's label, or of a bone with a label for each tissue
  std::string truth;                       // name of what it is compared with; empty: there is none
  MatchedBy matched = MatchedBy::nothing;  // of all bone: nothing
  double volume_cm3 = 0.0, truth_cm3 = 0.0;
  Agreement agreement;  // only with a counterpart
};

struct LabelComparison {
  std::vector<ComparedLabel> labels;  // in the case's order, and last all bone together
  std::vector<std::string> missing;   // labels of the truth without a counterpart in the case
};

// A label is compared with what has the same words in its name: a label, or all tissues of a bone. Where the case or
// the truth has no name but a number, as "bone 2" or "label 2", it is compared with the same number: that in its file
// if it has one. In a truth with tissues, the number is the bone's place among its bones. What was found by name is not
// found again by number. Errors: exhausted, cancelled, internal.
[[nodiscard]] Result<LabelComparison> compare_labels(const CaseScan& scan, const std::vector<CaseLabel>& labels,
                                                     const TruthLabels& truth, const KeepGoing& keep_going);

// As lines for a person.
[[nodiscard]] std::string comparison_text(const LabelComparison& comparison);

}  // namespace osteon::import
