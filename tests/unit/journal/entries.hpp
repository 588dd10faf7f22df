// Log entries for the tests of journals.
#pragma once
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#include "tests/support/disk/memory_disk.hpp"

namespace osteon {

// Of the tests' room, on a disk in memory.
inline constexpr const char* kFile = "/room/journal";

// Entries with the sequence numbers 1 to `count`.
inline std::vector<JournalEntry> some_entries(std::uint64_t seed, std::size_t count, std::size_t most_bytes = 300) {
  std::mt19937_64 random(seed);
  std::vector<JournalEntry> entries;
  for (std::size_t i = 1; i <= count; ++i) {
    JournalEntry entry{RoomSeq{i}, static_cast<std::int64_t>(random() >> 2), std::string(random() % most_bytes, '\0')};
    for (char& byte : entry.bytes) byte = static_cast<char>(random());
    entries.push_back(std::move(entry));
  }
  return entries;
}

inline bool equal(const std::vector<JournalEntry>& a, const std::vector<JournalEntry>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const JournalEntry& x, const JournalEntry& y) {
    return x.seq == y.seq && x.at_ns == y.at_ns && x.bytes == y.bytes;
  });
}

inline std::vector<JournalEntry> entries_of(Journal& journal, std::uint64_t from = 1) {
  std::vector<JournalEntry> entries;
  const Result<void> read = journal.read(RoomSeq{from}, [&](const JournalEntry& entry) {
    entries.push_back(entry);
    return true;
  });
  EXPECT_TRUE(read) << read.error().message;
  return entries;
}

// Appends the entries from index `from` up to `to`, in one batch.
inline void append(Journal& journal, const std::vector<JournalEntry>& entries, std::size_t from, std::size_t to) {
  const Result<void> done = journal.append(std::span(entries).subspan(from, to - from));
  ASSERT_TRUE(done) << done.error().message;
}

// The file of a checkpoint, found by its sequence number.
inline std::filesystem::path checkpoint_path(const test::MemoryDisk& disk, const JournalHead& at) {
  for (const auto& [name, bytes] : disk.image())
    if (name.find("-" + std::to_string(at.seq.value) + "-") != std::string::npos && name.ends_with(".checkpoint"))
      return name;
  return {};
}

}  // namespace osteon
