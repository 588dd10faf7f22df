#include "server/import/raw_volume.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "server/import/numbered_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

struct NamedType {
  std::string_view name;
  std::size_t bytes;
};
NamedType named(RawType type) {
  switch (type) {
    case RawType::int16:
      return {"int16", 2};
    case RawType::uint16:
      return {"uint16", 2};
    case RawType::uint8:
      return {"uint8", 1};
    case RawType::float32:
      break;
  }
  return {"float32", 4};
}

template <class T>
double number_at(const char* bytes, bool reversed) {
  std::array<char, sizeof(T)> copy{};
  std::memcpy(copy.data(), bytes, sizeof(T));
  if (reversed) std::ranges::reverse(copy);
  return static_cast<double>(std::bit_cast<T>(copy));
}

double stored_at(const char* bytes, RawType type, bool reversed) {
  switch (type) {
    case RawType::int16:
      return number_at<std::int16_t>(bytes, reversed);
    case RawType::uint16:
      return number_at<std::uint16_t>(bytes, reversed);
    case RawType::uint8:
      return number_at<std::uint8_t>(bytes, reversed);
    case RawType::float32:
      break;
  }
  return number_at<float>(bytes, reversed);
}

// Every file must have exactly the bytes that the format says: otherwise its numbers are others.
Result<void> check_bytes(const fs::path& file, const RawFormat& format, int slices) {
  std::error_code error;
  const std::uint64_t found = fs::file_size(file, error);
  if (error) return failure(ErrorCode::not_found, "cannot read " + file.string() + ": " + error.message());
  const NamedType type = named(format.type);
  const auto [columns, rows, all] = format.size;
  const std::uint64_t needed = format.skip_bytes + static_cast<std::uint64_t>(columns) *
                                                       static_cast<std::uint64_t>(rows) *
                                                       static_cast<std::uint64_t>(slices) * type.bytes;
  if (found == needed) return {};
  const std::string skipped = format.skip_bytes == 0 ? "" : " after " + std::to_string(format.skip_bytes) + " bytes";
  return bad_input(file.string() + " has " + std::to_string(found) + " bytes, but " + std::to_string(columns) + "x" +
                   std::to_string(rows) + "x" + std::to_string(slices) + " voxels of " + std::string(type.name) +
                   skipped + " need " + std::to_string(needed) + "; correct --size, --type or --skip-bytes");
}

// The files, each with so many slices.
struct Files {
  std::vector<fs::path> paths;
  int slices = 0;
};

Result<Files> files_of_volume(const fs::path& input, const RawFormat& format) {
  std::error_code error;
  if (!fs::exists(input, error))
    return failure(ErrorCode::not_found, "there is no file or folder " + input.string() + "; give a raw volume");
  Files files{{input}, format.size[2]};
  if (fs::is_directory(input, error)) {
    auto numbered = numbered_files(input, "", "a raw slice in each numbered file");
    if (!numbered) return tl::unexpected(numbered.error());
    if (numbered->size() != static_cast<std::size_t>(format.size[2]))
      return bad_input(input.string() + " has " + std::to_string(numbered->size()) + " slices, but --size says " +
                       std::to_string(format.size[2]) + "; correct --size, or copy the whole stack");
    files = {std::move(*numbered), 1};
  }
  for (const fs::path& file : files.paths)
    if (auto checked = check_bytes(file, format, files.slices); !checked) return tl::unexpected(checked.error());
  return files;
}

}  // namespace

Result<CtScan> read_raw_volume(const fs::path& input, const RawFormat& format, const KeepGoing& keep_going) try {
  const Result<Files> files = files_of_volume(input, format);
  if (!files) return tl::unexpected(files.error());
  CtScan scan;
  imaging::HuVolume& volume = scan.volume;
  volume = volume_of(format.size, format.given);
  volume.values.reserve(volume.count());
  const std::size_t voxel_bytes = named(format.type).bytes;
  std::vector<char> slice(static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]) *
                          voxel_bytes);
  const bool reversed = format.big_endian == (std::endian::native == std::endian::little);
  int read = 0;
  for (const fs::path& file : files->paths) {
    std::ifstream in(file, std::ios::binary);
    in.seekg(static_cast<std::streamoff>(format.skip_bytes));
    for (int i = 0; i < files->slices; ++i) {
      if (!keep_going(static_cast<double>(read++) / volume.dims[2])) return stopped_while("reading " + input.string());
      if (!in.read(slice.data(), static_cast<std::streamsize>(slice.size())))
        return bad_input(file.string() + " cannot be read to its end; copy it again");
      for (std::size_t at = 0; at < slice.size(); at += voxel_bytes) {
        const double stored = stored_at(slice.data() + at, format.type, reversed);
        const bool number = std::isfinite(stored);
        scan.report.without_number += number ? 0 : 1;
        volume.values.push_back(number ? hu_of(stored, format.given) : kPadding_hu);
      }
    }
  }
  scan.source = source_of("raw", volume, format.given);
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, input.string() + " takes more memory than this machine has; give a part of it");
}

}  // namespace osteon::import
