// A phantom bone as others see it: what a CT scanner shows, and the exact truth.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "common/phantoms/phantom_case.hpp"
#include "server/import/simulated_scanner.hpp"

namespace osteon::import {

// HU around a phantom bone, LPS: air does not reach it.
inline constexpr double kAroundBone_hu = 40.0;

// HU as a scanner's blur shows them, with the bone's structures. Each face is an edge that depends on its distance
// alone, so faces must be much less curved than the blur is wide. The texture of cancellous bone is not blurred. `bone`
// must outlive it.
[[nodiscard]] BlurredHu blurred_hu(const phantoms::PhantomBone& bone, double blur_mm);

// Settings with slices that cover the bone and its structures, `slice_mm` apart and thick. At a sawn end they end in
// bone, so that what is open there is not taken for a hole.
[[nodiscard]] ScannerSettings scanner_around(const phantoms::PhantomBone& bone, ScannerSettings settings,
                                             double slice_mm);

// Makes the folder with truth.json (kind, side, parameters, landmarks, axes, planes; see
// deploy/docs/phantoms.md) and labels.nii.gz (0 outside, then the labels of the case). Errors: exists, internal (disk),
// cancelled.
[[nodiscard]] Result<void> write_truth(const phantoms::PhantomBone& bone, const phantoms::BoneRecipe& recipe,
                                       const phantoms::PhantomCase& made, const std::filesystem::path& folder,
                                       const KeepGoing& keep_going);

// The names of labels by their numbers, from the truth.json beside the labels.nii.gz of write_truth(). Empty for other
// files, and where truth.json is missing or is not one of a phantom bone: names are never needed to read the voxels.
[[nodiscard]] std::map<int, std::string> names_beside(const std::filesystem::path& labels);

}  // namespace osteon::import
