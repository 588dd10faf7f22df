#include "server/import/volume_reader.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "server/import/byte_stream.hpp"
#include "server/import/isolated_reader.hpp"
#include "server/import/nifti_names.hpp"
#include "server/import/slicer_segments.hpp"
#include "server/import/volume_file.hpp"
#include "server/import/volume_format.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kMostSkew = 1e-3;                           // of a cosine between two axes
constexpr std::size_t kBesideVoxels = std::size_t{1} << 30;  // bytes that the library may take beside the voxels
constexpr std::uint64_t kMostLayers = 1000;                  // of a segmentation
constexpr std::size_t kLongestNames = std::size_t{1} << 20;  // bytes, of the names in a NIfTI header
constexpr double kReadShare = 0.5;                           // of the time until the first slice comes

tl::unexpected<Error> wrong(const fs::path& file, const std::string& what) {
  return bad_input(file.string() + ": " + what + "; export it again");
}

Result<VolumeHeader> read_header(const fs::path& file, VolumeFormat format, VoxelContent content,
                                 const KeepGoing& keep_going) {
  VolumeHeader header;
  bool came = false;
  const IsolatedEnd end = run_isolated({.run = [&](ChildChannel& channel) -> Result<void> {
                                          const Result<VolumeHeader> found = read_volume_header(file, format, content);
                                          if (!found) return tl::unexpected(found.error());
                                          channel.send({reinterpret_cast<const char*>(&*found), sizeof *found});
                                          return {};
                                        },
                                        .on_message =
                                            [&](std::string_view message) {
                                              if (message.size() != sizeof header) return false;
                                              std::memcpy(&header, message.data(), sizeof header);
                                              return came = true;
                                            }},
                                       keep_going);
  if (end.died || (end.result && !came)) return wrong(file, "it is damaged");
  if (!end.result) return tl::unexpected(end.result.error());
  return header;
}

struct OpenedVolume {
  VolumeFormat format = VolumeFormat::none;
  VolumeHeader header;
};
Result<OpenedVolume> open_volume(const fs::path& file, VoxelContent content, const KeepGoing& keep_going) {
  std::error_code error;
  if (!fs::exists(file, error))
    return failure(ErrorCode::not_found, "there is no file " + file.string() + "; give a " +
                                             (content == VoxelContent::hu ? "CT volume" : "label map"));
  const VolumeFormat format = volume_format(file);
  if (format == VolumeFormat::none) return wrong(file, "it is neither NIfTI nor NRRD nor MetaImage");
  if (auto known = check_kind(file, format); !known) return tl::unexpected(known.error());
  const Result<VolumeHeader> header = read_header(file, format, content, keep_going);
  if (!header) return tl::unexpected(header.error());
  return OpenedVolume{format, *header};
}

// The volume without its voxels.
Result<imaging::HuVolume> geometry_of(const fs::path& file, const VolumeHeader& header) {
  imaging::HuVolume volume;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto i = static_cast<Eigen::Index>(d);
    if (header.dims[d] < 2 || header.dims[d] > imaging::kLargestScanAxis)
      return wrong(file, "it has " + std::to_string(header.dims[d]) + " voxels along an axis, not 2 to " +
                             std::to_string(imaging::kLargestScanAxis));
    volume.dims[d] = static_cast<int>(header.dims[d]);
    volume.spacing_mm[i] = header.spacing_mm[d];
    volume.origin_mm[i] = header.origin_mm[d];
    volume.directions.col(i) = Vec3(header.axes[d][0], header.axes[d][1], header.axes[d][2]);
  }
  if (!volume.spacing_mm.allFinite() || !(volume.spacing_mm.minCoeff() > 0.0))
    return wrong(file, "the distance between its voxels is not a length above zero");
  if (!volume.origin_mm.allFinite() || !volume.directions.allFinite())
    return wrong(file, "its position or its directions are not numbers");
  const Eigen::Matrix3d cosines = volume.directions.transpose() * volume.directions;
  if ((cosines - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kMostSkew)
    return wrong(file, "its axes are not at right angles");
  return volume;
}

Result<void> read_voxels(const fs::path& file, VolumeFormat format, std::uint64_t voxel_bytes, CtScan& scan,
                         const KeepGoing& keep_going) {
  imaging::HuVolume& volume = scan.volume;
  const std::size_t area = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  const IsolatedEnd end =
      run_isolated({.run = [&](ChildChannel& channel) -> Result<void> {
                      if (auto whole = check_voxels(file, format, volume.count(), voxel_bytes); !whole) return whole;
                      int slices = 0;
                      return read_volume_slices(
                          file, format, [&](std::span<const std::int16_t> slice, std::uint32_t without_number) {
                            std::string message(reinterpret_cast<const char*>(slice.data()), slice.size_bytes());
                            message.append(reinterpret_cast<const char*>(&without_number), sizeof without_number);
                            channel.send(message);
                            channel.progress(kReadShare + (1.0 - kReadShare) * ++slices / volume.dims[2]);
                          });
                    },
                    .on_message =
                        [&](std::string_view message) {
                          // Memory grows with the voxels that arrive, not with the size that the file claims.
                          const std::size_t before = volume.values.size();
                          const std::size_t slice_bytes = area * sizeof(std::int16_t);
                          std::uint32_t without_number = 0;
                          if (message.size() != slice_bytes + sizeof without_number || before == volume.count())
                            return false;
                          volume.values.resize(before + area);
                          std::memcpy(volume.values.data() + before, message.data(), slice_bytes);
                          std::memcpy(&without_number, message.data() + slice_bytes, sizeof without_number);
                          scan.report.without_number += without_number;
                          return true;
                        },
                    .memory_bytes = volume.count() * voxel_bytes + kBesideVoxels},
                   keep_going);
  if (end.died) return wrong(file, "it is damaged, or takes more memory than this machine has");
  if (!end.result) return end.result;
  if (volume.values.size() != volume.count()) return wrong(file, "it is truncated");
  return {};
}

// Adds the voxels of a slice to the runs of their layer and value, row by row.
using RunsByLabel = std::map<std::pair<int, int>, std::vector<imaging::VoxelRun>>;
void add_runs(std::span<const std::uint16_t> labels, int layers, int slice, const imaging::HuVolume& grid,
              RunsByLabel& runs) {
  for (int layer = 0; layer < layers; ++layer)
    for (int row = 0; row < grid.dims[1]; ++row) {
      const auto at = [&](int column) {
        return labels[(static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.dims[0]) +
                       static_cast<std::size_t>(column)) *
                          static_cast<std::size_t>(layers) +
                      static_cast<std::size_t>(layer)];
      };
      for (int first = 0; first < grid.dims[0];) {
        int last = first;
        while (last + 1 < grid.dims[0] && at(last + 1) == at(first)) ++last;
        if (at(first) != 0) runs[{layer, at(first)}].push_back({first, last, row, slice, 0});
        first = last + 1;
      }
    }
}

Result<RunsByLabel> read_runs(const fs::path& file, const OpenedVolume& volume, const imaging::HuVolume& grid,
                              const KeepGoing& keep_going) {
  const auto layers = static_cast<std::size_t>(volume.header.layers);
  const std::size_t numbers = static_cast<std::size_t>(grid.dims[0]) * static_cast<std::size_t>(grid.dims[1]) * layers;
  RunsByLabel runs;
  int next = 0;
  std::vector<std::uint16_t> labels(numbers);
  IsolatedWork work;
  work.memory_bytes = grid.count() * volume.header.voxel_bytes + kBesideVoxels;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    if (auto whole = check_voxels(file, volume.format, grid.count(), volume.header.voxel_bytes); !whole) return whole;
    int slices = 0;
    return read_label_slices(file, volume.format, [&](std::span<const std::uint16_t> slice) {
      channel.send({reinterpret_cast<const char*>(slice.data()), slice.size_bytes()});
      channel.progress(kReadShare + (1.0 - kReadShare) * ++slices / grid.dims[2]);
    });
  };
  work.on_message = [&](std::string_view message) {
    if (message.size() != numbers * sizeof(std::uint16_t) || next == grid.dims[2]) return false;
    std::memcpy(labels.data(), message.data(), message.size());
    add_runs(labels, static_cast<int>(layers), next++, grid, runs);
    return true;
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  if (end.died) return wrong(file, "it is damaged, or takes more memory than this machine has");
  if (!end.result) return tl::unexpected(end.result.error());
  if (next != grid.dims[2]) return wrong(file, "it is truncated");
  return runs;
}

// What the header says of labels: fields of segments of NRRD, or numbers and names of NIfTI.
Result<HeaderFields> read_label_fields(const fs::path& file, VolumeFormat format, const KeepGoing& keep_going) {
  HeaderFields fields;
  IsolatedWork work;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    Result<HeaderFields> found;
    if (format == VolumeFormat::nrrd) found = read_segment_fields(file);
    if (format == VolumeFormat::nifti)
      for (const auto& [number, name] : nifti_label_names(unpacked_head(file, kLongestNames)))
        found->emplace_back(std::to_string(number), name);
    if (!found) return tl::unexpected(found.error());
    for (const auto& [key, value] : *found) {
      ByteWriter packer;
      packer.add(key), packer.add(value);
      channel.send(packer.bytes());
    }
    return {};
  };
  work.on_message = [&](std::string_view message) {
    ByteReader from(message);
    std::string key, value;
    if (!from.get(key) || !from.get(value)) return false;
    fields.emplace_back(std::move(key), std::move(value));
    return true;
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  if (end.died) return wrong(file, "it is damaged");
  if (!end.result) return tl::unexpected(end.result.error());
  return fields;
}

// The segments of a file, with their names if it has some. `runs`: the voxels of each layer and value.
std::vector<LabelSegment> segments_of(std::vector<SlicerSegment> named, const HeaderFields& names, RunsByLabel runs) {
  std::vector<LabelSegment> segments;
  for (SlicerSegment& segment : named) {
    const auto found = runs.extract({segment.layer, segment.value});
    segments.push_back({.number = segment.value,
                        .name = std::move(segment.name),
                        .type = std::move(segment.type),
                        .runs = found ? std::move(found.mapped()) : std::vector<imaging::VoxelRun>{}});
  }
  for (auto& [label, voxels] : runs) {
    const auto name = std::ranges::find(names, std::to_string(label.second), &HeaderFields::value_type::first);
    segments.push_back({.number = label.second,
                        .name = name == names.end() ? "" : name->second,
                        .type = {},
                        .runs = std::move(voxels)});
  }
  return segments;
}

}  // namespace

Result<LabelMap> read_label_volume(const fs::path& file, const KeepGoing& keep_going) try {
  const auto opened = open_volume(file, VoxelContent::labels, keep_going);
  if (!opened) return tl::unexpected(opened.error());
  Result<imaging::HuVolume> grid = geometry_of(file, opened->header);
  if (!grid) return tl::unexpected(grid.error());
  const auto fields = read_label_fields(file, opened->format, keep_going);
  if (!fields) return tl::unexpected(fields.error());
  std::vector<SlicerSegment> named;
  if (opened->format == VolumeFormat::nrrd) {
    auto segments = slicer_segments(*fields);
    if (!segments) return wrong(file, segments.error().message);
    named = std::move(*segments);
  }
  if (opened->header.layers > kMostLayers || (opened->header.layers > 1 && named.empty()))
    return failure(ErrorCode::unsupported, file.string() +
                                               " has several numbers for each voxel, and is no segmentation of 3D "
                                               "Slicer; give a label map, with one number for each voxel");
  auto runs = read_runs(file, *opened, *grid, keep_going);
  if (!runs) return tl::unexpected(runs.error());
  LabelMap map;
  map.file = file.string();
  map.kind = named.empty() ? std::string(name_of(opened->format)) : "3D Slicer segmentation";
  map.grid = std::move(*grid);
  map.oriented = says_orientation(file, opened->format);
  map.segments = segments_of(std::move(named), *fields, std::move(*runs));
  return map;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, file.string() + " takes more memory than this machine has; export fewer labels");
}

Result<CtScan> read_volume(const fs::path& file, const KeepGoing& keep_going) try {
  const auto opened = open_volume(file, VoxelContent::hu, keep_going);
  if (!opened) return tl::unexpected(opened.error());
  const auto& [format, header] = *opened;
  Result<imaging::HuVolume> volume = geometry_of(file, header);
  if (!volume) return tl::unexpected(volume.error());
  CtScan scan;
  scan.volume = std::move(*volume);
  if (auto read = read_voxels(file, format, header.voxel_bytes, scan, keep_going); !read)
    return tl::unexpected(read.error());
  scan.source = std::string(name_of(format)) + " CT, " + imaging::describe(scan.volume);
  if (!says_orientation(file, format)) scan.source += ", orientation not in the file: left and right may be swapped";
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted,
                 file.string() + " takes more memory than this machine has; export thicker slices");
}

}  // namespace osteon::import
