// The entries of a program that is killed. The sequence number determines each of them.
#pragma once
#include <string>
#include <utility>

#include "server/journal/chain.hpp"

namespace osteon {

inline JournalEntry kill_entry(std::uint64_t seq) {
  std::string bytes(1 + seq * 7919 % 1500, static_cast<char>(seq));
  return {RoomSeq{seq}, static_cast<std::int64_t>(seq * 8'000'000), std::move(bytes)};
}

}  // namespace osteon
