#include "server/import/label_map.hpp"

#include <gdcmTrace.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/import/byte_stream.hpp"
#include "server/import/dicom_segments.hpp"
#include "server/import/found_files.hpp"
#include "server/import/isolated_reader.hpp"
#include "server/import/phantom_export.hpp"
#include "server/import/volume_format.hpp"
#include "server/import/volume_reader.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kVolumeEndings[] = {".nii.gz", ".nii", ".nrrd", ".nhdr", ".mha", ".mhd"};
constexpr std::size_t kMostStructures = 10'000;            // files of a folder
constexpr std::size_t kBesideFile = std::size_t{1} << 30;  // bytes that GDCM may take beside the file's
constexpr double kMostGridShift = 0.01;                    // of a voxel's edge, between files of one folder

// The ending of a volume's file name; empty for other files.
std::string_view ending_of(const std::string& name) {
  for (const std::string_view ending : kVolumeEndings)
    if (name.ends_with(ending) && name.size() > ending.size()) return ending;
  return "";
}

bool same_voxels(const imaging::HuVolume& a, const imaging::HuVolume& b) {
  if (a.dims != b.dims) return false;
  const Vec3 last(a.dims[0] - 1, a.dims[1] - 1, a.dims[2] - 1);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 voxel = last.cwiseProduct(Vec3(corner & 1, corner >> 1 & 1, corner >> 2));
    if ((a.position_mm(voxel) - b.position_mm(voxel)).norm() > kMostGridShift * a.spacing_mm.minCoeff()) return false;
  }
  return true;
}

// One file for each structure, as TotalSegmentator writes them.
Result<LabelMap> read_structures(const fs::path& folder, const std::vector<fs::path>& files,
                                 const KeepGoing& keep_going) {
  LabelMap map;
  map.file = folder.string();
  map.kind = "folder of label files";
  map.numbered = false;
  const auto count = static_cast<double>(files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const KeepGoing reading = part(keep_going, static_cast<double>(i) / count, static_cast<double>(i + 1) / count);
    auto one = read_label_volume(files[i], reading);
    if (!one) return one;
    if (one->segments.size() > 1 && files.size() == 1) return one;
    if (one->segments.size() > 1)
      return bad_input(files[i].string() +
                       " has several labels among other files of labels; give this file alone, or "
                       "a folder with one file for each structure");
    if (i == 0) map.grid = one->grid;
    map.oriented = map.oriented && one->oriented;
    if (!same_voxels(map.grid, one->grid))
      return bad_input(files[i].string() + " has other voxels than " + files[0].filename().string() +
                       "; export all structures on the voxels of the CT");
    std::string name = files[i].filename().string();
    name.resize(name.size() - ending_of(name).size());
    LabelSegment segment;
    segment.number = static_cast<int>(i) + 1;
    segment.name = std::move(name);
    if (!one->segments.empty()) segment.runs = std::move(one->segments.front().runs);
    map.segments.push_back(std::move(segment));
  }
  return map;
}

void pack(const DicomSegmentation& from, ByteWriter& to) {
  to.add(from.frame_of_reference), to.add(from.dims), to.add(from.spacing_mm), to.add(from.origin_mm);
  to.add(from.axes), to.add(from.segments.size());
  for (const DicomSegment& segment : from.segments) to.add(segment.number), to.add(segment.label), to.add(segment.type);
}

bool unpack(ByteReader& from, LabelMap& map) {
  DicomSegmentation s;
  std::size_t count = 0;
  if (!from.get(s.frame_of_reference) || !from.get(s.dims) || !from.get(s.spacing_mm) || !from.get(s.origin_mm) ||
      !from.get(s.axes) || !from.get(count))
    return false;
  for (const std::int32_t dim : s.dims)
    if (dim < 1 || dim > (1 << 16)) return false;
  map.frame_of_reference = s.frame_of_reference;
  map.grid.dims = {s.dims[0], s.dims[1], s.dims[2]};
  map.grid.spacing_mm = {s.spacing_mm[0], s.spacing_mm[1], s.spacing_mm[2]};
  map.grid.origin_mm = {s.origin_mm[0], s.origin_mm[1], s.origin_mm[2]};
  map.grid.directions.col(0) = Vec3(s.axes[0], s.axes[1], s.axes[2]);
  map.grid.directions.col(1) = Vec3(s.axes[3], s.axes[4], s.axes[5]);
  map.grid.directions.col(2) = map.grid.directions.col(0).cross(map.grid.directions.col(1));
  for (std::size_t i = 0; i < count; ++i) {
    LabelSegment segment;
    if (!from.get(segment.number) || !from.get(segment.name) || !from.get(segment.type)) return false;
    map.segments.push_back(std::move(segment));
  }
  return true;
}

// Runs of a frame, after the index of its segment.
bool add_frame(std::string_view message, LabelMap& map) {
  ByteReader from(message);
  std::size_t segment = 0, count = 0;
  if (!from.get(segment) || !from.get(count) || segment >= map.segments.size()) return false;
  if (count != from.rest().size() / sizeof(imaging::VoxelRun)) return false;
  const auto [columns, rows, slices] = map.grid.dims;
  std::vector<imaging::VoxelRun>& runs = map.segments[segment].runs;
  for (std::size_t i = 0; i < count; ++i) {
    imaging::VoxelRun run;
    if (!from.get(run)) return false;
    if (run.first < 0 || run.last < run.first || run.last >= columns || run.row < 0 || run.row >= rows ||
        run.slice < 0 || run.slice >= slices)
      return false;
    runs.push_back(run);
  }
  return true;
}

Result<LabelMap> read_dicom_segments(const fs::path& file, const KeepGoing& keep_going) {
  LabelMap map;
  map.file = file.string();
  map.kind = "DICOM SEG";
  bool has_header = false;
  std::error_code error;
  IsolatedWork work;
  work.memory_bytes = 2 * static_cast<std::size_t>(fs::file_size(file, error)) + kBesideFile;
  work.run = [&](ChildChannel& channel) {
    gdcm::Trace::DebugOff();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    return read_segmentation(
        file, file.string(),
        [&](const DicomSegmentation& header) {
          ByteWriter packer;
          pack(header, packer);
          channel.send(packer.bytes());
        },
        [&](std::size_t segment, const std::vector<imaging::VoxelRun>& runs) {
          ByteWriter packer;
          packer.add(segment), packer.add(runs.size());
          for (const imaging::VoxelRun& run : runs) packer.add(run);
          channel.send(packer.bytes());
          channel.progress(0.5);  // asks whether to go on
        });
  };
  work.on_message = [&](std::string_view message) {
    if (has_header) return add_frame(message, map);
    ByteReader from(message);
    return has_header = unpack(from, map);
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  if (end.died) return bad_input(file.string() + " is damaged so that it cannot be read; copy or export it again");
  if (!end.result) return tl::unexpected(end.result.error());
  if (!has_header) return failure(ErrorCode::internal, "the reader of " + file.string() + " ended early");
  return map;
}

Result<LabelMap> read_file(const fs::path& file, const KeepGoing& keep_going) {
  if (volume_format(file) != VolumeFormat::none) {
    auto map = read_label_volume(file, keep_going);
    if (!map) return map;
    const auto names = names_beside(file);
    for (LabelSegment& segment : map->segments)
      if (const auto name = names.find(segment.number); segment.name.empty() && name != names.end())
        segment.name = name->second;
    return map;
  }
  const InputKind kind = input_kind(file, keep_going);
  if (!keep_going(0.0)) return stopped_while("reading the labels");
  if (kind == InputKind::dicom_file) return read_dicom_segments(file, keep_going);
  return bad_input(file.string() +
                   " has no labels; give NIfTI, NRRD (.seg.nrrd), MetaImage or DICOM SEG, or a folder "
                   "with one such file for each structure");
}

Result<LabelMap> read_folder(const fs::path& folder, const KeepGoing& keep_going) {
  const auto found = find_files(folder, 0, keep_going);
  if (!found) return tl::unexpected(found.error());
  std::vector<fs::path> volumes;
  for (const FoundFile& file : found->files)
    if (!ending_of(file.path.filename().string()).empty()) volumes.push_back(file.path);
  if (volumes.size() > kMostStructures)
    return bad_input(folder.string() +
                     " has more than 10000 files of labels; give a folder with one for each "
                     "structure");
  if (!volumes.empty()) return read_structures(folder, volumes, keep_going);
  if (found->files.size() == 1) return read_file(found->files.front().path, keep_going);
  return bad_input(folder.string() +
                   " has no file of labels; give a folder with one NIfTI, NRRD or MetaImage file for "
                   "each structure, or one DICOM SEG file");
}

}  // namespace

std::int64_t LabelSegment::voxels() const {
  std::int64_t count = 0;
  for (const imaging::VoxelRun& run : runs) count += run.last - run.first + 1;
  return count;
}

Result<LabelMap> read_label_map(const fs::path& input, const KeepGoing& keep_going) try {
  std::error_code error;
  if (!fs::exists(input, error))
    return failure(ErrorCode::not_found, "there is no file or folder " + input.string() + "; give one with labels");
  auto map = fs::is_directory(input, error)      ? read_folder(input, keep_going)
             : fs::is_regular_file(input, error) ? read_file(input, keep_going)
                                                 : bad_input(input.string() + " is a pipe or device; give a file");
  if (map && std::ranges::all_of(map->segments, [](const LabelSegment& s) { return s.runs.empty(); }))
    return bad_input(input.string() + " has no labelled voxel, all are 0; export it again");
  return map;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted,
                 input.string() + " takes more memory than this machine has; export fewer labels");
}

}  // namespace osteon::import
