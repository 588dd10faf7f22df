// How much a .vdb file would take once it is loaded, told from its bytes alone. OpenVDB allocates what a file declares
// and does not notice that a file ends. So a file of strangers is walked through here before OpenVDB opens it.
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

// Any thread. Memory: 256 KiB, and two bytes a leaf of one grid. Reads the headers, the topology and the lengths of all
// compressed parts; values stay compressed. Takes what save_volumes() and save_fields() write: grids of float one
// behind the other, in format 224, compressed by Blosc or not at all. Whatever follows the last grid is not looked at.
// Errors: not_found; invalid_input (no such file, or damaged); exhausted (beyond the limits). Each names the file.
[[nodiscard]] Result<VdbSize> measure_vdb(const std::filesystem::path& file, const VdbLimits& limits);

}  // namespace osteon
