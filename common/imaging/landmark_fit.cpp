#include "common/imaging/landmark_fit.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace osteon::imaging {
namespace {

using Points = Eigen::Matrix3Xd;

// Root mean square distance from the best line, below which points count as being on it. Nobody places a landmark
// better than to about 1 mm, and the angle about the line would follow these errors alone.
constexpr double kLeastBeside_mm = 1.0, kLeastBesideShare = 0.02;  // share: of the points' spread along the line
// A mirrored fit counts as the truth if it is so much better, and the rigid one is bad.
constexpr double kMirroredShare = 0.5, kMirroredFrom_mm = 3.0;
constexpr double kOutlierShare = 3.0, kOutlierFrom_mm = 5.0;

std::array<double, 6> coordinates(const LandmarkPair& pair) {
  return {pair.fixed_mm.x(),  pair.fixed_mm.y(),  pair.fixed_mm.z(),
          pair.moving_mm.x(), pair.moving_mm.y(), pair.moving_mm.z()};
}

Points points_of(std::span<const LandmarkPair> pairs, Vec3 LandmarkPair::*scan) {
  Points points(3, static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) points.col(static_cast<Eigen::Index>(i)) = pairs[i].*scan;
  return points;
}

Result<void> check_spread(const Points& points, const std::string& scan) {
  const Points centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d covariance = centred * centred.transpose() / static_cast<double>(points.cols());
  const Vec3 spread = Eigen::JacobiSVD<Eigen::Matrix3d>(covariance).singularValues().cwiseSqrt();  // umeyama's type
  const double beside_mm = std::hypot(spread[1], spread[2]);
  if (beside_mm >= std::max(kLeastBeside_mm, kLeastBesideShare * spread[0])) return {};
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "the landmarks of the %s scan lie on a line, only %.2f mm beside it; add one that is far from the line",
                scan.c_str(), beside_mm);
  return bad_input(text.data());
}

Pose fitted(const Points& fixed, const Points& moving) {
  const Eigen::Matrix4d best = Eigen::umeyama(moving, fixed, false);
  return {best.topRightCorner<3, 1>(), Eigen::Quaterniond(best.topLeftCorner<3, 3>()).normalized()};
}

double rms_of(const std::vector<double>& residuals_mm) {
  double sum = 0.0;
  for (const double residual : residuals_mm) sum += residual * residual;
  return std::sqrt(sum / static_cast<double>(residuals_mm.size()));
}

// The pairs in an order of their own, because sums of rounded numbers depend on theirs.
std::vector<LandmarkPair> in_order(std::span<const LandmarkPair> pairs) {
  std::vector<LandmarkPair> sorted(pairs.begin(), pairs.end());
  std::ranges::sort(sorted, {}, coordinates);
  return sorted;
}

Pose fit_of(std::span<const LandmarkPair> pairs) {
  const std::vector<LandmarkPair> sorted = in_order(pairs);
  return fitted(points_of(sorted, &LandmarkPair::fixed_mm), points_of(sorted, &LandmarkPair::moving_mm));
}

Result<void> check_sides(std::span<const LandmarkPair> pairs, double rms_mm) {
  std::vector<LandmarkPair> mirrored(pairs.begin(), pairs.end());
  for (LandmarkPair& pair : mirrored) pair.moving_mm.x() = -pair.moving_mm.x();
  const double mirrored_mm = rms_of(landmark_residuals(mirrored, fit_of(mirrored)));
  if (rms_mm < kMirroredFrom_mm || mirrored_mm > kMirroredShare * rms_mm) return {};
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(),
                "the landmarks fit to %.1f mm, and to %.1f mm if one scan is mirrored; check that left and right are "
                "not swapped in a scan, and that no two landmarks are exchanged",
                rms_mm, mirrored_mm);
  return bad_input(text.data());
}

void find_outlier(std::span<const LandmarkPair> pairs, LandmarkFit& found) {
  if (pairs.size() <= kLeastLandmarks) return;
  double least_mm = found.rms_mm / kOutlierShare;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    std::vector<LandmarkPair> others(pairs.begin(), pairs.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const Pose pose = fit_of(others);
    const double rms_mm = rms_of(landmark_residuals(others, pose));
    const double own_mm = (pose.point(pairs[i].moving_mm) - pairs[i].fixed_mm).norm();
    if (rms_mm > least_mm || own_mm < kOutlierFrom_mm) continue;
    least_mm = rms_mm;
    found.outlier = i;
    found.outlier_mm = own_mm;
  }
}

}  // namespace

std::vector<double> landmark_residuals(std::span<const LandmarkPair> pairs, const Pose& pose_fixed_moving) {
  std::vector<double> residuals_mm;
  for (const LandmarkPair& pair : pairs)
    residuals_mm.push_back((pose_fixed_moving.point(pair.moving_mm) - pair.fixed_mm).norm());
  return residuals_mm;
}

Result<LandmarkFit> fit_landmarks(std::span<const LandmarkPair> pairs) {
  if (pairs.size() < kLeastLandmarks)
    return bad_input("there are " + std::to_string(pairs.size()) + " landmarks; give at least " +
                     std::to_string(kLeastLandmarks) + " that do not lie on a line");
  if (auto good = check_spread(points_of(pairs, &LandmarkPair::fixed_mm), "fixed"); !good)
    return tl::unexpected(good.error());
  if (auto good = check_spread(points_of(pairs, &LandmarkPair::moving_mm), "moving"); !good)
    return tl::unexpected(good.error());
  LandmarkFit found;
  found.pose_fixed_moving = fit_of(pairs);
  found.residuals_mm = landmark_residuals(pairs, found.pose_fixed_moving);
  found.rms_mm = rms_of(found.residuals_mm);
  if (auto good = check_sides(pairs, found.rms_mm); !good) return tl::unexpected(good.error());
  find_outlier(pairs, found);
  return found;
}

}  // namespace osteon::imaging
