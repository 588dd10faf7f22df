#include "server/import/scan_registration.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "common/imaging/calibration.hpp"

namespace osteon::import {
namespace {

constexpr double kLittleOverlap = 0.25;         // of the smaller scan
constexpr double kLittleInformation_nat = 0.3;  // [A] two scans of one bone share much more
constexpr double kFarFromLandmarks_mm = 3.0;    // [A] by which the search may worsen their fit without a warning
constexpr std::int64_t kLeastBoneVoxels = 100;  // that have a centre of mass worth a try

Result<void> check_places(const imaging::HuVolume& fixed, const imaging::HuVolume& moving,
                          const std::vector<NamedLandmark>& landmarks, const std::string& file) {
  for (const NamedLandmark& landmark : landmarks)
    for (const bool in_fixed : {true, false}) {
      const double beyond_mm =
          imaging::outside_scan_mm(in_fixed ? fixed : moving, in_fixed ? landmark.at.fixed_mm : landmark.at.moving_mm);
      if (beyond_mm <= 0.0) continue;
      std::array<char, 40> mm{};
      std::snprintf(mm.data(), mm.size(), "%.1f", beyond_mm);
      const std::string which = in_fixed ? "fixed" : "moving";
      return bad_input(file + ": " + landmark.name + " lies " + mm.data() + " mm outside the " + which +
                       " scan; correct its " + which + "_mm (LPS), or exchange the scans");
    }
  return {};
}

Vec3 middle_of(const imaging::HuVolume& scan) {
  return scan.position_mm(0.5 * Vec3(scan.dims[0] - 1, scan.dims[1] - 1, scan.dims[2] - 1));
}

// The centre of mass of all voxels that are bone by their HU. Nothing if there are hardly any. Error: cancelled.
Result<std::optional<Vec3>> bone_centre(const imaging::HuVolume& scan, const KeepGoing& keep_going) {
  Vec3 sum = Vec3::Zero();
  std::int64_t count = 0;
  std::size_t i = 0;
  for (int slice = 0; slice < scan.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / scan.dims[2])) return stopped_while("looking for bone");
    for (int row = 0; row < scan.dims[1]; ++row)
      for (int column = 0; column < scan.dims[0]; ++column) {
        if (scan.values[i++] < imaging::kBoneThreshold_hu) continue;
        sum += Vec3(column, row, slice);
        ++count;
      }
  }
  if (count < kLeastBoneVoxels) return std::optional<Vec3>();
  return std::optional(scan.position_mm(sum / static_cast<double>(count)));
}

struct Start {
  RegistrationStart kind;
  Pose pose_fixed_moving;
};

Result<std::vector<Start>> starts_of(const imaging::HuVolume& fixed, const imaging::HuVolume& moving,
                                     const KeepGoing& keep_going) {
  const auto shift = [](const Vec3& to, const Vec3& from) { return Pose{to - from, Eigen::Quaterniond::Identity()}; };
  std::vector<Start> starts{{RegistrationStart::as_they_lie, Pose{}},
                            {RegistrationStart::centres, shift(middle_of(fixed), middle_of(moving))}};
  const auto fixed_bone = bone_centre(fixed, part(keep_going, 0.0, 0.5));
  if (!fixed_bone) return tl::unexpected(fixed_bone.error());
  const auto moving_bone = bone_centre(moving, part(keep_going, 0.5, 1.0));
  if (!moving_bone) return tl::unexpected(moving_bone.error());
  if (*fixed_bone && *moving_bone) starts.push_back({RegistrationStart::bone, shift(**fixed_bone, **moving_bone)});
  return starts;
}

double rms_of(const std::vector<LandmarkResidual>& landmarks, double LandmarkResidual::*residual) {
  double sum = 0.0;
  for (const LandmarkResidual& landmark : landmarks) sum += landmark.*residual * landmark.*residual;
  return std::sqrt(sum / static_cast<double>(landmarks.size()));
}

template <class... Numbers>
std::string formatted(const char* format, Numbers... numbers) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, numbers...);
  return text.data();
}

void warn(ScanRegistration& made, const std::optional<imaging::LandmarkFit>& fit) {
  const imaging::RigidRegistration& found = made.found;
  if (fit && fit->outlier)
    made.warnings.push_back(
        formatted("landmark %zu is %.1f mm from where the others put it; check its place in both scans",
                  *fit->outlier + 1, fit->outlier_mm));
  if (!found.refined)
    made.warnings.emplace_back(
        "no pose with more mutual information was found near the start; the start is kept as it was");
  if (found.overlap < kLittleOverlap)
    made.warnings.push_back(
        formatted("the scans share only %.0f %% of the smaller one; check the result by eye", 100.0 * found.overlap));
  if (found.information < kLittleInformation_nat)
    made.warnings.push_back(formatted(
        "the scans share only %.3f nat of information; check that both show the same bone", found.information));
  if (made.landmarks.empty()) return;
  const double before_mm = rms_of(made.landmarks, &LandmarkResidual::at_start_mm);
  const double after_mm = rms_of(made.landmarks, &LandmarkResidual::at_result_mm);
  if (after_mm > before_mm + kFarFromLandmarks_mm)
    made.warnings.push_back(
        formatted("the search moved the landmarks from %.1f to %.1f mm apart (root mean square); check the result by "
                  "eye",
                  before_mm, after_mm));
}

}  // namespace

std::string_view name_of(RegistrationStart start) {
  switch (start) {
    case RegistrationStart::landmarks:
      return "landmarks";
    case RegistrationStart::as_they_lie:
      return "as the scans lie";
    case RegistrationStart::centres:
      return "centres of the scans";
    case RegistrationStart::bone:
      return "centres of mass of bone";
  }
  return "";
}

Result<ScanRegistration> register_scans(const imaging::HuVolume& fixed, const imaging::HuVolume& moving,
                                        const std::vector<NamedLandmark>& landmarks, const std::string& landmark_file,
                                        const KeepGoing& keep_going) {
  constexpr double kStartShare = 0.1;
  std::vector<Start> starts;
  std::optional<imaging::LandmarkFit> fit;
  std::vector<imaging::LandmarkPair> pairs;
  if (landmarks.empty()) {
    auto found = starts_of(fixed, moving, part(keep_going, 0.0, kStartShare));
    if (!found) return tl::unexpected(found.error());
    starts = std::move(*found);
  } else {
    if (auto good = check_places(fixed, moving, landmarks, landmark_file); !good) return tl::unexpected(good.error());
    for (const NamedLandmark& landmark : landmarks) pairs.push_back(landmark.at);
    auto fitted = imaging::fit_landmarks(pairs);
    if (!fitted) return bad_input(landmark_file + ": " + fitted.error().message);
    fit = std::move(*fitted);
    starts = {{RegistrationStart::landmarks, fit->pose_fixed_moving}};
  }
  std::vector<Pose> poses;
  for (const Start& start : starts) poses.push_back(start.pose_fixed_moving);
  auto found = imaging::register_rigidly(fixed, moving, poses, part(keep_going, kStartShare, 1.0));
  if (!found) return tl::unexpected(found.error());

  ScanRegistration made;
  made.start = starts[found->start].kind;
  made.found = *found;
  if (fit) {
    const auto residuals_mm = imaging::landmark_residuals(pairs, found->pose_fixed_moving);
    for (std::size_t i = 0; i < landmarks.size(); ++i)
      made.landmarks.push_back({landmarks[i].name, fit->residuals_mm[i], residuals_mm[i]});
  }
  warn(made, fit);
  return made;
}

std::string registration_text(const ScanRegistration& registration) {
  const imaging::RigidRegistration& found = registration.found;
  const Eigen::AngleAxisd turn(found.pose_fixed_moving.rotation);
  const Vec3& shift = found.pose_fixed_moving.position_mm;
  std::string text = "start      " + std::string(name_of(registration.start)) + "\n";
  text += formatted("rotation   %.2f degrees about %.3f %.3f %.3f\n", turn.angle() * 180.0 / std::numbers::pi,
                    turn.axis().x(), turn.axis().y(), turn.axis().z());
  text += formatted("shift      %.2f %.2f %.2f mm, of the origin of the moving scan's frame\n", shift.x(), shift.y(),
                    shift.z());
  text += formatted("overlap    %.0f %% of the smaller scan\n", 100.0 * found.overlap);
  text += formatted("mutual     %.3f nat of information, from %.3f at the start\n", found.information,
                    found.information_at_start);
  if (!registration.landmarks.empty()) {
    text += "landmarks   fit mm  now mm  name\n";
    for (const LandmarkResidual& landmark : registration.landmarks)
      text += formatted("           %7.2f %7.2f  ", landmark.at_start_mm, landmark.at_result_mm) + landmark.name + "\n";
    text += formatted("           %7.2f %7.2f  root mean square\n",
                      rms_of(registration.landmarks, &LandmarkResidual::at_start_mm),
                      rms_of(registration.landmarks, &LandmarkResidual::at_result_mm));
  }
  for (const std::string& warning : registration.warnings) text += "warning    " + warning + "\n";
  return text;
}

}  // namespace osteon::import
