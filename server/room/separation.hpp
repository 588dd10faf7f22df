// Fragments that have separated, as the fragment detector reports them to the room.
#pragma once
#include <cstdint>
#include <vector>

#include "common/volume/cut_field.hpp"
#include "common/volume/fragments.hpp"

namespace osteon {

// Fragments that have separated from a body.
// `fields`: the future field of each fragment that is not debris, in order. They are made beforehand because that takes
// long. Each is made from a copy of the parent that lacks only the changes that take_changes() has yet to return. Each
// belongs to the body that its fragment will become: next_body() and those after it. If a field is missing, the room
// makes it itself.
struct Separation {
  BodyId parent;
  std::vector<Fragment> fragments;
  std::uint64_t seen = 0;  // bone_epoch() of the room when the search began
  std::vector<CutField> fields = {};
};

}  // namespace osteon
