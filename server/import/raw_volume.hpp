// Reads a CT volume of plain numbers without a header.
#pragma once
#include <cstdint>
#include <filesystem>

#include "common/core/keep_going.hpp"
#include "server/import/given_geometry.hpp"

namespace osteon::import {

enum class RawType { int16, uint16, uint8, float32 };

struct RawFormat {
  std::array<int, 3> size{};  // columns, rows, slices; at least 2 each
  RawType type = RawType::int16;
  bool big_endian = false;
  std::uint64_t skip_bytes = 0;  // of each file, before its first voxel
  GivenGeometry given;
};

// `input`: a file with all slices, or a folder with one for each, numbered at the end of their names. Columns are
// fastest, then rows, then slices. Errors: not_found, invalid_input (a file that is longer or shorter than the format
// says, a slice that is missing), exhausted (memory), cancelled.
[[nodiscard]] Result<CtScan> read_raw_volume(const std::filesystem::path& input, const RawFormat& format,
                                             const KeepGoing& keep_going);

}  // namespace osteon::import
