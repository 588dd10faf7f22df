// The hash of a cut field's state. Equal sets of cuts give equal hashes.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

// One leaf of a cut field as it is stored and sent: distances in quanta of 2^-10 mm, z fastest.
struct FieldLeaf {
  BodyId body;
  int level = 0;
  Coord origin;                      // samples of the level; a multiple of kLeafSize
  std::vector<std::int16_t> values;  // kLeafVoxels values, or one value for all samples
  // Whether the leaf has one value. A leaf that lists equal values may not be recognised as constant.
  [[nodiscard]] bool is_constant() const { return values.size() == 1; }
  [[nodiscard]] std::int16_t value(std::size_t sample) const {
    return values.size() == 1 ? values.front() : values[sample];
  }
  [[nodiscard]] bool holds_values() const { return values.size() == 1 || values.size() == std::size_t{kLeafVoxels}; }
  void expand();   // lists every sample
  void compact();  // keeps one value if all are equal
  // Compares the values of the samples, not how they are listed.
  friend bool operator==(const FieldLeaf& a, const FieldLeaf& b);
};

// Hash over the leaves sorted by (body, level, origin). Leaves at full band everywhere count as absent.
[[nodiscard]] Digest field_hash(std::vector<FieldLeaf> leaves, double pitch_mm);

}  // namespace osteon
