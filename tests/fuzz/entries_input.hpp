// Encodes log entries of a room as one input of a fuzz target. Also changes such inputs so that most of an input stays
// valid.
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

// One log entry: offset of its sequence number from the next expected one, time since the entry before it was decided,
// and its bytes.
// The two ends of the time's range stand for the earliest and the latest possible time.
struct Record {
  std::int8_t off = 0, later = 1;
  std::string bytes;
};

// What else is done with the entries. Bits of `how`.
inline constexpr unsigned kFromCheckpoint = 1, kAsText = 2, kGoOn = 4, kDraw = 8;

// Encoded as two bytes, then four bytes and the entry's own bytes for each entry.
struct EntriesInput {
  std::uint8_t how = 0;
  std::uint8_t checkpoint = 0;  // its sequence number
  std::vector<Record> records;
};
// Any bytes are a valid input. A truncated record has the bytes that are there.
[[nodiscard]] EntriesInput entries_input(std::span<const std::uint8_t> data);
[[nodiscard]] Bytes to_bytes(const EntriesInput& input);

inline constexpr std::chrono::nanoseconds kStep = std::chrono::milliseconds(8);
[[nodiscard]] std::chrono::nanoseconds time_of(const Record& record, std::chrono::nanoseconds before);

// Makes one change. It drops, doubles or moves an entry, or sets one field of one entry to a dangerous number.
void change_entries(Bytes& data, std::mt19937& random);

}  // namespace osteon::fuzz
