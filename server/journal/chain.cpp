#include "server/journal/chain.hpp"

namespace osteon {

JournalHead first_head(std::string_view genesis) {
  Hasher hasher;
  hasher.text("osteon journal");
  hasher.text(genesis);
  return {RoomSeq{0}, hasher.finish()};
}

JournalHead next_head(const JournalHead& before, const JournalRow& row) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(before.chain.bytes)));
  hasher.integer(row.place.value);
  hasher.integer(static_cast<std::uint64_t>(row.at_ns));
  hasher.text(row.bytes);
  return {row.place, hasher.finish()};
}

}  // namespace osteon
