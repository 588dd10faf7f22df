// The name of a cut field's state: equal sets of cuts give equal hashes.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

// One leaf of a cut field as it is stored and sent: distance in quanta of 2^-10 mm, z fastest.
struct FieldLeaf {
  BodyId body;
  int level = 0;
  Coord origin;                      // samples of the level; a multiple of kLeafSize
  std::vector<std::int16_t> values;  // kLeafVoxels, or one that all samples have
  // A leaf of one value; one that lists them all need not be seen as such.
  [[nodiscard]] bool is_constant() const { return values.size() == 1; }
  [[nodiscard]] std::int16_t value(std::size_t sample) const {
    return values.size() == 1 ? values.front() : values[sample];
  }
  [[nodiscard]] bool holds_values() const { return values.size() == 1 || values.size() == std::size_t{kLeafVoxels}; }
  void expand();   // lists every sample
  void compact();  // keeps one value where all are equal
  // Of what the samples are, not of how they are listed.
  friend bool operator==(const FieldLeaf& a, const FieldLeaf& b);
};

// Hash over the leaves sorted by (body, level, origin); leaves at full band everywhere count as absent.
[[nodiscard]] Digest field_hash(std::vector<FieldLeaf> leaves, double pitch_mm);

}  // namespace osteon
