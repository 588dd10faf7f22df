// Rows of the journal and the chain of hashes that binds each to all before it.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"

namespace osteon {

struct JournalEntry {
  RoomSeq place;           // rises by exactly one; the first is 1
  std::int64_t at_ns = 0;  // when it was decided, since the room was made: for replay
  std::string bytes;       // the room's own encoding
};

// How far a journal goes, and what it says: equal heads, equal histories. Whoever was told of an entry keeps it as a
// witness.
struct JournalHead {
  RoomSeq place;
  Digest chain;
  friend bool operator==(const JournalHead&, const JournalHead&) = default;
};

// The same with a seal by which the room's store knows its own word again, for those who are not to be believed
// without.
struct Witness {
  JournalHead head;
  Digest seal;
};

// chain_0 = SHA-256(text "osteon journal", text genesis); a text is its length as 8 bytes, little endian, and its
// bytes.
[[nodiscard]] JournalHead first_head(std::string_view genesis);
// chain_n = SHA-256(chain_n-1, place, at_ns, text bytes), integers as 8 bytes, little endian.
[[nodiscard]] JournalHead next_head(const JournalHead& before, const JournalEntry& entry);

}  // namespace osteon
