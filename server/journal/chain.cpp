#include "server/journal/chain.hpp"

namespace osteon {

JournalHead first_head(std::string_view genesis) {
  Hasher hasher;
  hasher.text("osteon journal");
  hasher.text(genesis);
  return {RoomSeq{0}, hasher.finish()};
}

JournalHead next_head(const JournalHead& before, const JournalEntry& entry) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(before.chain.bytes)));
  hasher.integer(entry.seq.value);
  hasher.integer(static_cast<std::uint64_t>(entry.at_ns));
  hasher.text(entry.bytes);
  return {entry.seq, hasher.finish()};
}

}  // namespace osteon
