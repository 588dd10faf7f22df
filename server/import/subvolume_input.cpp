#include "server/import/subvolume_input.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <utility>

#include "common/imaging/calibration.hpp"
#include "common/imaging/components.hpp"
#include "common/imaging/island_kinds.hpp"
#include "common/imaging/segmentation.hpp"
#include "common/subvolumes/bounding_boxes.hpp"
#include "common/subvolumes/subvolume_file.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/ct_case.hpp"
#include "server/import/structure_names.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// The bone in a part of the scan. `dense`: its voxels at or above the threshold.
Result<imaging::VoxelMask> largest_bone(const imaging::HuVolume& part_of_scan, imaging::VoxelMask dense,
                                        const imaging::ScanEnds& ends, double threshold_hu,
                                        const KeepGoing& keep_going) {
  imaging::SegmentationParams params;
  params.threshold_hu = threshold_hu;
  auto bone = imaging::segment_bone(part_of_scan, std::move(dense), params, ends, part(keep_going, 0.0, 0.7));
  if (!bone) return bone;
  const auto islands = imaging::find_islands(part_of_scan, *bone, {}, part(keep_going, 0.7, 0.85));
  if (!islands) return tl::unexpected(islands.error());
  const auto natures =
      imaging::name_islands(part_of_scan, *bone, *islands, imaging::kMetal_hu, part(keep_going, 0.85, 1.0));
  if (!natures) return tl::unexpected(natures.error());
  const auto found = std::ranges::find(*natures, imaging::IslandKind::bone, &imaging::IslandNature::kind);
  if (found == natures->end())
    return bad_input("no part at or above the threshold of " + std::to_string(std::lround(threshold_hu)) +
                     " HU is bone; give another --threshold");
  const int number = static_cast<int>(found - natures->begin()) + 1;
  return imaging::number_bones(*islands, std::array{number}, true, part_of_scan.dims);
}

constexpr double kOffVoxel = 0.01;              // of a voxel: two files lie on the same voxels
constexpr double kMostVoxelsOfFiles = 1 << 30;  // of the box around all of them

// Where the voxels of each file begin in the box around all files, and that box.
struct PlacedFiles {
  std::array<double, 3> origin_mm{};
  std::array<int, 3> dims{};
  std::vector<Coord> first = {};
};
Result<PlacedFiles> place_files(const std::vector<subvolumes::SubVolumeData>& files, const std::string& name) {
  PlacedFiles placed{.origin_mm = files.front().origin_mm};
  for (const auto& file : files)
    for (std::size_t axis = 0; axis < 3; ++axis)
      placed.origin_mm[axis] = std::min(placed.origin_mm[axis], file.origin_mm[axis]);
  std::array<double, 3> dims{};
  for (const auto& file : files) {
    std::array<double, 3> first{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = (file.origin_mm[axis] - placed.origin_mm[axis]) / file.spacing_mm[axis];
      first[axis] = std::round(at);
      dims[axis] = std::max(dims[axis], first[axis] + file.dims[axis]);
      if (!(std::abs(at - first[axis]) <= kOffVoxel))
        return bad_input("the ORIGIN of the files that " + name +
                         " lists are not whole voxels apart; write all of them from one scan");
    }
    if (!(dims[0] * dims[1] * dims[2] <= kMostVoxelsOfFiles) || !(std::ranges::max(dims) <= imaging::kLargestScanAxis))
      return bad_input("the files that " + name + " lists are too far apart by their ORIGIN; write them again");
    placed.first.push_back({static_cast<int>(first[0]), static_cast<int>(first[1]), static_cast<int>(first[2])});
  }
  for (std::size_t axis = 0; axis < 3; ++axis) placed.dims[axis] = static_cast<int>(dims[axis]);
  return placed;
}

ScanGeometry scan_geometry_of(const imaging::HuVolume& volume) {
  return {volume.dims, volume.origin_mm, volume.directions * volume.spacing_mm.asDiagonal()};
}

// The part of a volume within the region.
imaging::HuVolume copied(const imaging::HuVolume& volume, const ScanRegion& region) {
  imaging::HuVolume copy = without_values(volume);
  copy.origin_mm = volume.position_mm(Vec3(region.first[0], region.first[1], region.first[2]));
  for (std::size_t axis = 0; axis < 3; ++axis) copy.dims[axis] = region.last[axis] - region.first[axis] + 1;
  copy.values.reserve(copy.count());
  for (int slice = region.first[2]; slice <= region.last[2]; ++slice)
    for (int row = region.first[1]; row <= region.last[1]; ++row) {
      const auto from = volume.values.begin() + static_cast<std::ptrdiff_t>(volume.index(region.first[0], row, slice));
      copy.values.insert(copy.values.end(), from, from + copy.dims[0]);
    }
  return copy;
}

}  // namespace

bool is_case(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / "case.json", error);
}

Result<SubVolumeInput> input_of_case(const fs::path& folder, const KeepGoing& keep_going) {
  const auto bone = Case::load(folder);
  if (!bone) return tl::unexpected(bone.error());
  auto scan = load_scan(folder, *bone, keep_going);
  if (!scan) return tl::unexpected(scan.error());
  if (scan->hu.empty() || scan->labels.empty())
    return bad_input(folder.string() + " has no HU, because it was not made from CT; give a case or a scan that has");
  std::bitset<256> carved;
  for (const CaseLabel& label : bone->info().labels)
    if (is_carved(label.kind)) carved.set(static_cast<std::size_t>(label.value));
  SubVolumeInput input{.geometry = scan->geometry,
                       .hu = std::move(scan->hu),
                       .bone = scan->labels.dense(),
                       .threshold_hu = bone->info().threshold_hu,
                       .what = "the part that a case keeps of " + bone->info().source};
  for (std::uint8_t& label : input.bone) label = carved.test(label) ? 1 : 0;
  if (std::ranges::count(input.bone, 1) == 0)
    return bad_input(folder.string() + " has no voxel of bone in its scan; import it again");
  return input;
}

Result<SubVolumeInput> input_in_source(const SubVolumeInput& of_case, CtScan source, const std::string& name) {
  imaging::HuVolume& volume = source.volume;
  SubVolumeInput input{.geometry = {volume.dims, volume.origin_mm, volume.directions * volume.spacing_mm.asDiagonal()},
                       .hu = {},
                       .bone = std::vector<std::uint8_t>(volume.count(), 0),
                       .threshold_hu = of_case.threshold_hu,
                       .what = source.source};
  const auto& [dims, origin_mm, axes_mm] = of_case.geometry;
  const Vec3 at = input.geometry.axes_mm.inverse() * (origin_mm - input.geometry.origin_mm);
  const Vec3 last(dims[0] - 1, dims[1] - 1, dims[2] - 1);
  bool fits = (axes_mm - input.geometry.axes_mm).colwise().norm().dot(last) <= kOffVoxel * axes_mm.norm();
  std::array<int, 3> first{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from = at[static_cast<int>(axis)];
    fits = fits && std::abs(from - std::round(from)) <= kOffVoxel && from > -0.5 &&
           from + dims[axis] < volume.dims[axis] + 0.5;
    first[axis] = fits ? static_cast<int>(std::lround(from)) : 0;
  }
  if (!fits)
    return bad_input("the voxels of the case are not some of those of " + name +
                     "; give the scan from which the case was imported as --source");
  auto from = of_case.bone.begin();
  for (int slice = 0; slice < dims[2]; ++slice)
    for (int row = 0; row < dims[1]; ++row, from += dims[0])
      std::copy_n(
          from, dims[0],
          input.bone.begin() + static_cast<std::ptrdiff_t>(volume.index(first[0], first[1] + row, first[2] + slice)));
  input.hu = std::move(volume.values);
  return input;
}

bool is_meta_file(const fs::path& file) {
  std::error_code error;
  return file.filename() == subvolumes::kMetaFile && fs::is_regular_file(file, error);
}

Result<SubVolumeInput> input_of_files(const fs::path& meta_file, double threshold_hu, const KeepGoing& keep_going) {
  const auto files = subvolumes::read_sub_volumes(meta_file, keep_going);
  if (!files) return tl::unexpected(files.error());
  const auto placed = place_files(*files, meta_file.string());
  if (!placed) return tl::unexpected(placed.error());
  SubVolumeInput input;
  const std::array<double, 3>& spacing_mm = files->front().spacing_mm;
  input.geometry = {placed->dims, Vec3(placed->origin_mm[0], placed->origin_mm[1], placed->origin_mm[2]),
                    Vec3(spacing_mm[0], spacing_mm[1], spacing_mm[2]).asDiagonal()};
  input.threshold_hu = threshold_hu;
  input.what = "files of " + std::to_string(files->size()) + " sub-volumes";
  input.hu.assign(input.geometry.count(), subvolumes::kAir_hu);
  for (std::size_t i = 0; i < files->size(); ++i) {
    const auto& [columns, rows, slices] = (*files)[i].dims;
    auto from = (*files)[i].hu.begin();
    for (int z = 0; z < slices; ++z)
      for (int y = 0; y < rows; ++y, from += columns)
        std::copy_n(
            from, columns,
            input.hu.begin() + static_cast<std::ptrdiff_t>(input.voxels().index(placed->first[i] + Coord{0, y, z})));
  }
  input.bone.reserve(input.hu.size());
  for (const std::int16_t hu : input.hu) input.bone.push_back(hu >= threshold_hu ? 1 : 0);
  if (std::ranges::count(input.bone, 1) == 0)
    return bad_input("no voxel of the files that " + meta_file.string() + " lists reaches the threshold of " +
                     std::to_string(std::lround(threshold_hu)) + " HU; give a lower --threshold");
  return input;
}

Result<SubVolumeInput> input_of_scan(CtScan scan, double threshold_hu, const KeepGoing& keep_going) {
  imaging::HuVolume& volume = scan.volume;
  auto dense = imaging::dense_voxels(volume, threshold_hu, part(keep_going, 0.0, 0.1));
  if (!dense) return tl::unexpected(dense.error());
  SubVolumeInput input{.geometry = {volume.dims, volume.origin_mm, volume.directions * volume.spacing_mm.asDiagonal()},
                       .hu = {},
                       .bone = std::move(dense->values),
                       .threshold_hu = threshold_hu,
                       .what = scan.source};
  const auto slices = subvolumes::slice_boxes(input.voxels(), part(keep_going, 0.1, 0.15));
  if (!slices) return tl::unexpected(slices.error());
  const CoordBox box = subvolumes::object_box(*slices);
  const ScanRegion region =
      region_around({box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}, volume, {});
  dense->values = std::move(input.bone);
  auto cropped = imaging::cropped(std::move(*dense), region.first, region.last, part(keep_going, 0.15, 0.2));
  if (!cropped) return tl::unexpected(cropped.error());
  const auto bone =
      largest_bone(copied(volume, region), std::move(*cropped), region.ends, threshold_hu, part(keep_going, 0.2, 1.0));
  if (!bone) return tl::unexpected(bone.error());
  input.hu = std::move(volume.values);
  input.bone.assign(input.hu.size(), 0);
  for (int slice = 0; slice < bone->dims[2]; ++slice)
    for (int row = 0; row < bone->dims[1]; ++row)
      std::copy_n(bone->values.begin() + static_cast<std::ptrdiff_t>(bone->index(0, row, slice)), bone->dims[0],
                  input.bone.begin() + static_cast<std::ptrdiff_t>(volume.index(region.first[0], region.first[1] + row,
                                                                                region.first[2] + slice)));
  return input;
}

Result<SubVolumeInput> input_of_marked(CtScan scan, const LabelMap& marks, double threshold_hu,
                                       const KeepGoing& keep_going) {
  imaging::HuVolume& volume = scan.volume;
  const ScanGeometry of_scan = scan_geometry_of(volume), of_marks = scan_geometry_of(marks.grid);
  const Vec3 last(volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1);
  const double apart_mm =
      (of_scan.origin_mm - of_marks.origin_mm).norm() + (of_scan.axes_mm - of_marks.axes_mm).colwise().norm().dot(last);
  if (of_scan.dims != of_marks.dims || !(apart_mm <= kOffVoxel * volume.spacing_mm.minCoeff()))
    return bad_input("the voxels of " + marks.file +
                     " are not those of the scan; give --bone a file with a number for each voxel of this scan");
  imaging::VoxelMask bone(volume.dims);
  for (const LabelSegment& segment : marks.segments) {
    if (!keep_going(0.0)) return stopped_while("reading the bone");
    for (const imaging::VoxelRun& run : segment.runs) imaging::fill_run(bone, run, 1);
  }
  return SubVolumeInput{.geometry = of_scan,
                        .hu = std::move(volume.values),
                        .bone = std::move(bone.values),
                        .threshold_hu = threshold_hu,
                        .what = scan.source + ", bone of a label map"};
}

}  // namespace osteon::import
