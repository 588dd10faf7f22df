// Baseline of the import of a CT: ITK reads a DICOM folder, applies a threshold, labels, resamples and measures the
// distance to the largest bone, with one thread. The distance is Maurer's, exact between samples.
// ApproximateSignedDistanceMap takes less time, but stops with an error where the gradient of the mask vanishes, as in
// thin bone.
#pragma once
#include <array>
#include <string>

namespace osteon::baselines {

struct ItkBone {
  std::array<int, 3> dims{};  // of the distances
  double pitch_mm = 0.0;      // between them: the smallest spacing of the scan
  double volume_mm3 = 0.0;    // of the samples within the bone
};

// Keeps the largest island of voxels at or above the threshold (26 neighbours), and crops the scan to it. Frees what is
// not needed any more, as far as ITK can. Throws what ITK throws.
[[nodiscard]] ItkBone itk_chain(const std::string& folder, double threshold_hu);

}  // namespace osteon::baselines
