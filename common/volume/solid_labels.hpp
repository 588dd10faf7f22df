// Connected components of the solid samples in one box: samples with f < 0 whose voxels share a face (six neighbours).
// Solids that meet only at an edge are separate, as in marching cubes with our table.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

// labels: 0 for air, otherwise 1, 2, … in the order of the first sample, z fastest. Returns the number of components.
int label_solid(Coord dims, std::span<const float> solid_mm, std::vector<std::uint16_t>& labels);

// Sets of numbers that can be united.
class UnionFind {
 public:
  void reset(std::size_t count);
  std::uint32_t add();
  std::uint32_t find(std::uint32_t i);
  void unite(std::uint32_t a, std::uint32_t b);  // the smaller number represents the union

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace osteon
