// The files that osteon-import writes for the window: the HU of a scan, and the numbers of its islands.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/volume/case_description.hpp"

namespace osteon {

// Columns fastest, then rows, then slices.
template <class Value>
struct VoxelFile {
  ScanGeometry geometry;
  std::vector<Value> values;

  [[nodiscard]] std::size_t index(const std::array<int, 3>& voxel) const {
    return (static_cast<std::size_t>(voxel[2]) * static_cast<std::size_t>(geometry.dims[1]) +
            static_cast<std::size_t>(voxel[1])) *
               static_cast<std::size_t>(geometry.dims[0]) +
           static_cast<std::size_t>(voxel[0]);
  }
  [[nodiscard]] bool contains(const std::array<int, 3>& voxel) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (voxel[axis] < 0 || voxel[axis] >= geometry.dims[axis]) return false;
    return true;
  }
  [[nodiscard]] Value at(const std::array<int, 3>& voxel) const { return values[index(voxel)]; }
};
using ShownScan = VoxelFile<std::int16_t>;  // HU

// Reads an NRRD file without compression, as "osteon-import export-scan" and "osteon-import islands" write it. Errors:
// not_found, invalid_input (another kind of file, or it ends early), exhausted (memory).
[[nodiscard]] Result<ShownScan> read_scan_file(const std::filesystem::path& file);
[[nodiscard]] Result<VoxelFile<std::uint8_t>> read_number_file(const std::filesystem::path& file);

// The header of such a file of numbers. Its voxels follow, a byte each.
[[nodiscard]] std::string number_file_header(const ScanGeometry& geometry);

}  // namespace osteon
