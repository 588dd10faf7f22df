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
// Both take four bytes.
enum class VdbValues { floats, integers };
struct VdbSize {
  std::uint64_t memory_bytes = 0;
  std::uint64_t leaves = 0;  // of the largest grid
};

// Any thread. Memory: 256 KiB, and two bytes for each leaf of one grid. Reads the headers, the topology and the lengths
// of all compressed parts. Values stay compressed. Accepts what save_volumes(), save_fields() and save_scan() write:
// consecutive grids of `values`, float or int32, in format 224, compressed by Blosc or not at all. Data after the last
// grid is ignored. Errors: not_found; invalid_input (no such file, or damaged); exhausted (beyond the limits). Each
// names the file.
[[nodiscard]] Result<VdbSize> measure_vdb(const std::filesystem::path& file, const VdbLimits& limits,
                                          VdbValues values = VdbValues::floats);

// Memory that the grids of a case's file may take. A case of a temporal bone at 0.1 mm takes 0.5 GiB, five times the
// size of its file. A file that declares more than twelve times its size, and more than 768 MiB, is damaged or hostile.
// So a file of up to 64 MiB stays below 1 GiB.
[[nodiscard]] std::uint64_t most_case_memory(const std::filesystem::path& file);

}  // namespace osteon
