// A map from coordinates in one array. Finding takes a fraction of the time of std::unordered_map.
#pragma once
#include <absl/container/flat_hash_map.h>
#include <absl/hash/hash.h>

#include <cstddef>

#include "common/geometry/lattice.hpp"

namespace osteon {

// By all bits of the coordinates. absl::flat_hash_map takes the place from some bits of the hash, and CoordHash leaves
// them alike for neighbours.
struct SpreadCoordHash {
  std::size_t operator()(const Coord& at) const { return absl::HashOf(at.x, at.y, at.z); }
};

// A pointer to a value is valid until the next insertion. The order of the values differs between two runs.
template <class Value>
using CoordMap = absl::flat_hash_map<Coord, Value, SpreadCoordHash>;

}  // namespace osteon
