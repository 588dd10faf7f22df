// Connected components of the solid samples of one box: samples with f < 0 that share a face of their voxels (six
// neighbours). Marching cubes with our table keeps solids apart that meet at an edge only, and so does this.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

// labels: 0 for air, else 1, 2, … in the order of the first sample, z fastest. Returns how many.
int label_solid(Coord dims, std::span<const float> solid_mm, std::vector<std::uint16_t>& labels);

// Sets of numbers that can be united.
class UnionFind {
 public:
  void reset(std::size_t count);
  std::uint32_t add();
  std::uint32_t find(std::uint32_t i);
  void unite(std::uint32_t a, std::uint32_t b);  // the smaller name stays

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace osteon
