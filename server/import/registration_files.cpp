#include "server/import/registration_files.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "common/core/digest.hpp"
#include "common/imaging/moved_volume.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/new_folder.hpp"
#include "server/import/volume_file.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLabelNumber = 65535;

nlohmann::json numbers(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// SHA-256 over the scan's grid and HU: the same scan has the same one, whatever file it comes from.
Digest fingerprint(const imaging::HuVolume& scan) {
  Hasher hasher;
  for (const int count : scan.dims) hasher.integer(static_cast<std::uint64_t>(count));
  for (const double value : scan.spacing_mm) hasher.number(value);
  for (const double value : scan.origin_mm) hasher.number(value);
  for (const double value : scan.directions.reshaped()) hasher.number(value);
  hasher.bytes(std::as_bytes(std::span(scan.values)));
  return hasher.finish();
}

nlohmann::json description_of(const imaging::HuVolume& scan) {
  return {{"sha256", to_hex(fingerprint(scan))}, {"voxels", scan.dims}, {"spacing_mm", numbers(scan.spacing_mm)}};
}

std::string to_json(const ScanRegistration& registration, const imaging::HuVolume& fixed,
                    const imaging::HuVolume& moving) {
  const imaging::RigidRegistration& found = registration.found;
  const Pose& pose = found.pose_fixed_moving;
  // About the middle of the moving scan: then the translation is how far that goes, whatever the rotation.
  const Vec3 centre = moving.position_mm(0.5 * Vec3(moving.dims[0] - 1, moving.dims[1] - 1, moving.dims[2] - 1));
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  nlohmann::json rows = nlohmann::json::array();
  for (int row = 0; row < 3; ++row) rows.push_back(numbers(rotation.row(row).transpose()));
  nlohmann::json landmarks = nlohmann::json::array();
  for (const LandmarkResidual& landmark : registration.landmarks)
    landmarks.push_back({{"at_start_mm", landmark.at_start_mm}, {"at_result_mm", landmark.at_result_mm}});
  const nlohmann::json file{
      {"kind", "rigid registration"},
      {"version", 1},
      {"rotation", rows},
      {"centre_mm", numbers(centre)},
      {"translation_mm", numbers(pose.point(centre) - centre)},
      {"fixed", description_of(fixed)},
      {"moving", description_of(moving)},
      {"start", std::string(name_of(registration.start))},
      {"refined", found.refined},
      {"mutual_information_nat", {{"at_start", found.information_at_start}, {"at_result", found.information}}},
      {"overlap", found.overlap},
      {"landmarks", landmarks},
      {"warnings", registration.warnings}};
  return file.dump(2) + "\n";
}

VolumeHeader header_on(const imaging::HuVolume& grid, std::uint64_t voxel_bytes) {
  VolumeHeader header;
  header.voxel_bytes = voxel_bytes;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto axis = static_cast<int>(d);
    header.dims[d] = static_cast<std::uint64_t>(grid.dims[d]);
    header.spacing_mm[d] = grid.spacing_mm[axis];
    header.origin_mm[d] = grid.origin_mm[axis];
    for (int row = 0; row < 3; ++row) header.axes[d][static_cast<std::size_t>(row)] = grid.directions(row, axis);
  }
  return header;
}

}  // namespace

Result<DrawnLabels> draw_labels(const LabelMap& map, const imaging::HuVolume& moving) {
  if (imaging::overlap_of(moving, map.grid, Pose{}) < imaging::kLeastOverlap)
    return bad_input(map.file + " does not lie on the moving scan; give a label map of that scan");
  DrawnLabels drawn;
  drawn.grid = map.grid;
  drawn.values.assign(map.grid.count(), 0);
  std::set<int> taken;
  for (const LabelSegment& segment : map.segments) {
    int number = map.numbered && segment.number >= 1 && segment.number <= kMostLabelNumber ? segment.number : 1;
    while (taken.contains(number)) ++number;
    if (number > kMostLabelNumber) return bad_input(map.file + " has more than 65535 labels; leave some out");
    taken.insert(number);
    if (!segment.name.empty()) drawn.names.emplace_back(number, segment.name);
    for (const imaging::VoxelRun& run : segment.runs)
      for (int column = run.first; column <= run.last; ++column) {
        std::uint16_t& value = drawn.values[map.grid.index(column, run.row, run.slice)];
        if (value != 0)
          return bad_input(map.file +
                           " has voxels that are in two structures; export it so that each voxel has one "
                           "label");
        value = static_cast<std::uint16_t>(number);
      }
  }
  return drawn;
}

Result<void> write_registration(const fs::path& folder, const ScanRegistration& registration,
                                const imaging::HuVolume& fixed, const imaging::HuVolume& moving,
                                const std::optional<DrawnLabels>& labels, const KeepGoing& keep_going) {
  const Pose& pose = registration.found.pose_fixed_moving;
  return write_new_folder(folder, [&](const fs::path& into) -> Result<void> {
    if (auto written = write_file(into / kTransformFile, to_json(registration, fixed, moving)); !written)
      return written;
    const auto hu = imaging::moved_hu(fixed, moving, pose, part(keep_going, 0.0, 0.4));
    if (!hu) return tl::unexpected(hu.error());
    if (auto written =
            write_hu_volume(into / kMovedScanFile, VolumeFormat::nifti, header_on(fixed, sizeof(std::int16_t)), *hu);
        !written)
      return written;
    if (!keep_going(0.7)) return stopped_while("writing the moved scan");
    if (!labels) return {};
    const auto moved = imaging::moved_labels(fixed, labels->grid, labels->values, pose, part(keep_going, 0.7, 0.9));
    if (!moved) return tl::unexpected(moved.error());
    if (auto written = write_label_volume(into / kMovedLabelsFile, VolumeFormat::nifti,
                                          header_on(fixed, sizeof(std::uint16_t)), *moved);
        !written)
      return written;
    if (!keep_going(1.0)) return stopped_while("writing the moved labels");
    return {};
  });
}

}  // namespace osteon::import
