#include "server/import/volume_reader.hpp"

#include <cstdint>
#include <cstring>
#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include "server/import/isolated_reader.hpp"
#include "server/import/volume_file.hpp"
#include "server/import/volume_format.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kMostSkew = 1e-3;                           // of a cosine between two axes
constexpr std::size_t kBesideVoxels = std::size_t{1} << 30;  // bytes that the library may take beside the voxels
constexpr double kReadShare = 0.5;                           // of the time until the first slice comes

tl::unexpected<Error> wrong(const fs::path& file, const std::string& what) {
  return bad_input(file.string() + ": " + what + "; export it again, or give the DICOM series");
}

Result<VolumeHeader> read_header(const fs::path& file, VolumeFormat format, const KeepGoing& keep_going) {
  VolumeHeader header;
  bool came = false;
  const IsolatedEnd end = run_isolated({.run = [&](ChildChannel& channel) -> Result<void> {
                                          const Result<VolumeHeader> found = read_volume_header(file, format);
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

Result<void> read_voxels(const fs::path& file, VolumeFormat format, std::uint64_t voxel_bytes,
                         imaging::HuVolume& volume, const KeepGoing& keep_going) {
  const std::size_t area = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  const IsolatedEnd end =
      run_isolated({.run = [&](ChildChannel& channel) -> Result<void> {
                      if (auto whole = check_voxels(file, format, volume.count(), voxel_bytes); !whole) return whole;
                      int slices = 0;
                      return read_volume_slices(file, format, [&](std::span<const std::int16_t> slice) {
                        channel.send({reinterpret_cast<const char*>(slice.data()), slice.size_bytes()});
                        channel.progress(kReadShare + (1.0 - kReadShare) * ++slices / volume.dims[2]);
                      });
                    },
                    .on_message =
                        [&](std::string_view message) {
                          // Memory grows with the voxels that arrive, not with the size that the file claims.
                          const std::size_t before = volume.values.size();
                          if (message.size() != area * sizeof(std::int16_t) || before == volume.count()) return false;
                          volume.values.resize(before + area);
                          std::memcpy(volume.values.data() + before, message.data(), message.size());
                          return true;
                        },
                    .memory_bytes = volume.count() * voxel_bytes + kBesideVoxels},
                   keep_going);
  if (end.died) return wrong(file, "it is damaged, or takes more memory than this machine has");
  if (!end.result) return end.result;
  if (volume.values.size() != volume.count()) return wrong(file, "it is truncated");
  return {};
}

}  // namespace

Result<CtScan> read_volume(const fs::path& file, const KeepGoing& keep_going) try {
  std::error_code error;
  if (!fs::exists(file, error))
    return failure(ErrorCode::not_found, "there is no file " + file.string() + "; give a CT volume");
  const VolumeFormat format = volume_format(file);
  if (format == VolumeFormat::none) return wrong(file, "it is neither NIfTI nor NRRD nor MetaImage");
  if (auto known = check_kind(file, format); !known) return tl::unexpected(known.error());
  const Result<VolumeHeader> header = read_header(file, format, keep_going);
  if (!header) return tl::unexpected(header.error());
  Result<imaging::HuVolume> volume = geometry_of(file, *header);
  if (!volume) return tl::unexpected(volume.error());
  if (auto read = read_voxels(file, format, header->voxel_bytes, *volume, keep_going); !read)
    return tl::unexpected(read.error());
  CtScan scan;
  scan.source = std::string(name_of(format)) + " CT, " + imaging::describe(*volume);
  if (!says_orientation(file, format)) scan.source += ", orientation not in the file: left and right may be swapped";
  scan.volume = std::move(*volume);
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted,
                 file.string() + " takes more memory than this machine has; export thicker slices");
}

}  // namespace osteon::import
