// A persisted room that one author cuts, for the tests of its maintenance.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/storage/room_store.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon::test {

struct KeptCuts {
  // Opens the journal if there is one, and otherwise creates it.
  KeptCuts(const std::filesystem::path& file, Disk* disk, const std::string& name, unsigned seed = 1)
      : options{.name = name,
                .limits = {},
                .tools = nullptr,
                .journal = {.disk = disk},
                .retention_days = 0,
                .today = {},
                .random = {}} {
    open(file);
    hand = room->join(MemberKind::surgeon, 1);
    cuts = strokes(hand, 400, seed);
  }

  void open(const std::filesystem::path& file) {
    Result<PersistedRoom> kept = RoomStore::open(file, test_block(), options);
    ASSERT_TRUE(kept) << kept.error().message;
    room.emplace(std::move(kept->room));
    store = std::move(kept->store);
  }

  // Makes `count` strokes with a mark after each. Every fifth stroke is undone.
  void cut(int count) {
    for (int i = 0; i < count; ++i) {
      room->set_time(room->time() + std::chrono::milliseconds(8));
      Cut next = cuts.at(room->decided(hand));
      next.lease_epoch = room->lease_epoch(hand);
      ASSERT_TRUE(room->submit(next));
      ASSERT_TRUE(room->mark(hand, "stroke"));
      if (i % 5 != 4) continue;
      ASSERT_TRUE(room->undo_last(hand, 1, {}));
    }
    keep();
  }
  void keep() {
    const Result<void> kept = store->write(room->take_entries());
    ASSERT_TRUE(kept) << kept.error().message;
  }
  void checkpoint() {
    const Result<void> done = store->checkpoint(room->room_seq(), room->all_leaves());
    ASSERT_TRUE(done) << done.error().message;
  }
  BoneAt bone() const { return {room->room_seq(), room->field_hash()}; }

  RoomStore::Options options;
  std::optional<Room> room;
  std::unique_ptr<RoomStore> store;
  AuthorId hand;
  std::vector<Cut> cuts;
};

// Log entries of `bytes` each that no room has checked. Only the chain examines them.
inline std::vector<LogEntry> plain_entries(RoomSeq after, std::size_t count, std::size_t bytes = 20) {
  std::vector<LogEntry> entries;
  for (std::size_t i = 1; i <= count; ++i) {
    const RoomSeq seq{after.value + i};
    std::string label = std::to_string(seq.value) + ".";
    entries.push_back(
        {seq, std::chrono::nanoseconds(seq.value), AuthorId{1}, MarkEntry{label + std::string(bytes, 'x')}});
  }
  return entries;
}

// The room that a replay of these entries makes.
inline Room replay_of(const std::vector<LogEntry>& entries) {
  Room room(test_block());
  for (const LogEntry& entry : entries) {
    const Result<void> followed = room.replay(entry);
    EXPECT_TRUE(followed) << followed.error().message;
  }
  return room;
}

inline std::vector<LogEntry> entries_of(RoomStore& store, RoomSeq to) {
  std::vector<LogEntry> entries;
  const Result<void> read = store.read(RoomSeq{1}, to, [&](const LogEntry& entry) {
    entries.push_back(entry);
    return true;
  });
  EXPECT_TRUE(read) << read.error().message;
  return entries;
}

}  // namespace osteon::test
