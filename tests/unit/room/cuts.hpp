// Cuts for the room's tests: seeded strokes of a burr and a drill over a plain block, and a room that commits them.
#pragma once
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "server/room/room.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {

inline constexpr double kBlockPitch_mm = 0.5;
inline Case test_block() { return plain_block(24.0, 12.0, kBlockPitch_mm); }

inline Tool tool_named(std::string_view name) { return find_tool(name).value(); }

// Short strokes at random points of the block's upper face, numbered from 1.
inline std::vector<Cut> strokes(AuthorId author, int count, unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  const Tool burr = tool_named("burr-round-5"), drill = tool_named("drill-3.2");
  std::vector<Cut> cuts;
  for (int i = 1; i <= count; ++i) {
    const Vec3 from{between(-9, 9), between(-9, 9), between(-3, 0)};
    const Vec3 to = from + Vec3{between(-1, 1), between(-1, 1), between(-1, 0)};
    Cut cut = straight_cut(i % 2 ? burr : drill, from, to, {0, 0, -1}, static_cast<std::uint64_t>(i));
    cut.author = author;
    cuts.push_back(cut);
  }
  return cuts;
}

inline RoomSeq commit_cut(Room& room, const Cut& cut) {
  const Result<Outcome> outcome = room.submit(cut);
  EXPECT_TRUE(outcome.has_value()) << outcome.error().message;
  EXPECT_TRUE(outcome->committed()) << sentence(outcome->rejection);
  return outcome->room_seq;
}

}  // namespace osteon::test
