// Log entries of the journal, and the chain of hashes that binds each entry to all entries before it.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"

namespace osteon {

struct JournalEntry {
  RoomSeq seq;             // rises by exactly one; the first is 1
  std::int64_t at_ns = 0;  // when it was decided, since the room was made; for replay
  std::string bytes;       // the room's own encoding
};

// How far a journal goes, and what it says: equal heads mean equal histories. Whoever had an entry acknowledged stores
// the head as a witness.
struct JournalHead {
  RoomSeq seq;
  Digest chain;
  friend bool operator==(const JournalHead&, const JournalHead&) = default;
};

// A head with a seal by which the room's store recognises a head that it issued itself. It is for clients, which are
// not trusted without a seal.
struct Witness {
  JournalHead head;
  Digest seal;
};

// chain_0 = SHA-256(text "osteon journal", text genesis). A text is its length as 8 bytes, little endian, then its
// bytes.
[[nodiscard]] JournalHead first_head(std::string_view genesis);
// chain_n = SHA-256(chain_n-1, place, at_ns, text bytes), integers as 8 bytes, little endian.
[[nodiscard]] JournalHead next_head(const JournalHead& before, const JournalEntry& entry);

}  // namespace osteon
