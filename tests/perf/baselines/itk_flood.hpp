// Region growing as a user of ITK writes it.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace osteon::test {

struct ItkFlood {
  std::vector<std::uint8_t> mask;  // 1: in the region
  double ms = 0.0;                 // CPU time of the filter alone
};

// The voxels of `low_hu` to `high_hu` that are connected with the seed across faces, by ConnectedThreshold on one
// thread. `dims`: columns, rows, slices.
[[nodiscard]] ItkFlood itk_flood(const std::array<int, 3>& dims, std::span<const std::int16_t> hu,
                                 const std::array<int, 3>& seed, std::int16_t low_hu, std::int16_t high_hu);

}  // namespace osteon::test
