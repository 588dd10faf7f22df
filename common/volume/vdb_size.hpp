// Computes from the bytes of a .vdb file how much memory it would take. OpenVDB allocates what a file declares and does
// not notice when a file ends early. So untrusted files are measured here before OpenVDB opens them.
#pragma once
#include <cstdint>
#include <filesystem>

#include "common/core/result.hpp"

namespace osteon {

struct VdbLimits {
  std::uint64_t memory_bytes = 0;  // of the nodes of all grids
  std::uint64_t leaves = 0;        // of one grid: leaf nodes, and constants counted in leaves
  std::uint32_t grids = 0;
};
struct VdbSize {
  std::uint64_t memory_bytes = 0;
  std::uint64_t leaves = 0;  // of the largest grid
};

// Any thread. Memory: 256 KiB, and two bytes for each leaf of one grid. Reads the headers, the topology and the lengths
// of all compressed parts. Values stay compressed. Accepts what save_volumes() and save_fields() write: consecutive
// grids of float, in format 224, compressed by Blosc or not at all. Data after the last grid is ignored. Errors:
// not_found; invalid_input (no such file, or damaged); exhausted (beyond the limits). Each names the file.
[[nodiscard]] Result<VdbSize> measure_vdb(const std::filesystem::path& file, const VdbLimits& limits);

}  // namespace osteon
