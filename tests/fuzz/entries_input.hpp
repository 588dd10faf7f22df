// Rows of a room as one input of a fuzz target, and changes to them that keep most of an input valid.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// One entry: how far its place is from the one that comes next, how long after the one before it was decided, its
// bytes. A time of either end of the range stands for the earliest and the latest that there are.
struct Record {
  std::int8_t off = 0, later = 1;
  std::string bytes;
};

// What else is done with the entries: bits of `how`.
inline constexpr unsigned kFromCheckpoint = 1, kAsText = 2, kGoOn = 4, kDraw = 8;

// Two bytes, then of each entry four and its own.
struct EntriesInput {
  std::uint8_t how = 0;
  std::uint8_t checkpoint = 0;  // its place
  std::vector<Record> records;
};
// Any bytes are one; a record that is cut short has what is there.
[[nodiscard]] EntriesInput entries_input(std::span<const std::uint8_t> data);
[[nodiscard]] Bytes to_bytes(const EntriesInput& input);

inline constexpr std::chrono::nanoseconds kStep = std::chrono::milliseconds(8);
[[nodiscard]] std::chrono::nanoseconds time_of(const Record& record, std::chrono::nanoseconds before);

// One change: an entry dropped, doubled or moved, or one field of one entry set to a number that may hurt.
void change_entries(Bytes& data, std::mt19937& random);

}  // namespace osteon::fuzz
