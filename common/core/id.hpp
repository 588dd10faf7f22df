// Distinct types for identifiers, null when zero. So an author is never passed where a body is meant.
#pragma once
#include <compare>
#include <cstdint>

namespace osteon {

template <class Tag>
struct Id {
  std::uint64_t value = 0;
  friend auto operator<=>(const Id&, const Id&) = default;
  explicit operator bool() const noexcept { return value != 0; }
};

using AuthorId = Id<struct AuthorTag>;  // given by the server at every join, never reused
using RoomSeq = Id<struct RoomSeqTag>;  // sequence number of an event in its room; 0 is the imported bone

// A body's number within its room; 0 is the case's bone, so there is no null body.
struct BodyId {
  std::uint32_t value = 0;
  friend auto operator<=>(const BodyId&, const BodyId&) = default;
};

}  // namespace osteon
