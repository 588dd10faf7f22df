// Rigid registration of two scans by points that a person has found in both.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::imaging {

inline constexpr std::size_t kLeastLandmarks = 3;

// The same point of the patient in two scans, LPS of each.
struct LandmarkPair {
  Vec3 fixed_mm = Vec3::Zero(), moving_mm = Vec3::Zero();
};

struct LandmarkFit {
  Pose pose_fixed_moving;            // the moving scan seen from the fixed one
  std::vector<double> residuals_mm;  // of each pair: distance between its points after the fit
  double rms_mm = 0.0;               // of the residuals
  // The pair without which the others fit much better, if there is one. It counts in the fit all the same.
  std::optional<std::size_t> outlier;
  double outlier_mm = 0.0;  // its distance after a fit of the others
};

// The distance between the points of each pair, mm.
[[nodiscard]] std::vector<double> landmark_residuals(std::span<const LandmarkPair> pairs,
                                                     const Pose& pose_fixed_moving);

// The rotation and translation with the least sum of squared residuals, in closed form (Umeyama 1991, without scale).
// The order of the pairs changes no bit of the pose. An outlier needs at least four pairs to be found. Errors:
// invalid_input (fewer than three pairs, points on or near a line in one scan, points that fit only a mirrored scan).
[[nodiscard]] Result<LandmarkFit> fit_landmarks(std::span<const LandmarkPair> pairs);

}  // namespace osteon::imaging
