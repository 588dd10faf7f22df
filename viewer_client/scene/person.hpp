// The people of a room as a window is told of them: who is there, what was decided about whom, what is drawn and said.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/id.hpp"
#include "common/field/supervision.hpp"
#include "common/surface/look.hpp"
#include "common/tools/annotation.hpp"

namespace osteon {

// Somebody with an identity in the room.
struct Person {
  AuthorId author{};
  std::string name{};  // empty: nobody's
  Role role = Role::none;
  bool here = false;   // connected now
  bool hand = false;   // has a device
  Supervision supervision{};
  RoomSeq decided{};   // the place of what was decided last, null: nothing was; they know of it once `heard` is not less
  RoomSeq heard{};
  std::optional<Look> look{};  // from where they look now; none where nobody knows
  std::uint32_t cuts = 0;      // of theirs that were taken
};

struct SaidWords {
  RoomSeq place{};
  AuthorId from{};
  AuthorId to{};  // null: all
  std::string words{};
};

// What came since the change before. Whatever is named replaces what was told of it before.
struct PeopleChange {
  bool complete = false;  // all people and annotations that there are; what is not named is gone
  std::vector<Person> people{};
  std::vector<Annotation> annotations{};
  std::vector<std::uint32_t> wiped{};  // annotations that are gone
  std::vector<SaidWords> words{};      // oldest first
  RoomSeq room_seq{};                  // last event that is contained
};

}  // namespace osteon
