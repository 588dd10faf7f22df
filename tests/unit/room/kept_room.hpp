// A room that is kept in a journal, cut by one hand: for the tests of its maintenance.
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/net/room_store.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon::test {

struct KeptCuts {
  // A new one, or, where there is a journal, that one gone on with.
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

  // So many strokes, each with a mark after it; every fifth is taken back.
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
    const Result<void> kept = store->write(room->take_rows());
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

// Rows that nobody has judged, of `bytes` each: what only a chain has to do with.
inline std::vector<RoomRow> plain_rows(RoomSeq after, std::size_t count, std::size_t bytes = 20) {
  std::vector<RoomRow> rows;
  for (std::size_t i = 1; i <= count; ++i) {
    const RoomSeq place{after.value + i};
    std::string label = std::to_string(place.value) + ".";
    rows.push_back(
        {place, std::chrono::nanoseconds(place.value), AuthorId{1}, MarkRow{label + std::string(bytes, 'x')}});
  }
  return rows;
}

// The room of these rows, through nothing but a replay.
inline Room replay_of(const std::vector<RoomRow>& rows) {
  Room room(test_block());
  for (const RoomRow& row : rows) {
    const Result<void> followed = room.replay(row);
    EXPECT_TRUE(followed) << followed.error().message;
  }
  return room;
}

inline std::vector<RoomRow> rows_of(RoomStore& store, RoomSeq to) {
  std::vector<RoomRow> rows;
  const Result<void> read = store.read(RoomSeq{1}, to, [&](const RoomRow& row) {
    rows.push_back(row);
    return true;
  });
  EXPECT_TRUE(read) << read.error().message;
  return rows;
}

}  // namespace osteon::test
