// Pieces that have come apart, as whoever looks for them tells the room.
#pragma once
#include <cstdint>
#include <vector>

#include "common/volume/cut_field.hpp"
#include "common/volume/fragments.hpp"

namespace osteon {

// What has come apart from a body. `fields`: for each piece that is no debris, in order, the field that it will have,
// made beforehand because that takes long: from a copy of the parent in which nothing is missing but what
// take_changes() has yet to tell. Each of the body that the piece will be, next_body() and on; without it the room
// makes the field itself.
struct Separation {
  BodyId parent;
  std::vector<Fragment> fragments;
  std::uint64_t seen = 0;  // bone_epoch() when it was looked for
  std::vector<CutField> fields = {};
};

}  // namespace osteon
