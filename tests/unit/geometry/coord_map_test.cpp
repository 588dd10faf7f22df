#include "common/geometry/coord_map.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <unordered_map>

namespace osteon {
namespace {

// The same insertions, searches and removals as in the standard library's map, in a small box, so that many meet.
TEST(CoordMap, HoldsWhatTheStandardMapHolds) {
  std::mt19937 random(7);
  std::uniform_int_distribution<std::int32_t> along(-4, 4);
  std::uniform_int_distribution<int> action(0, 9);
  CoordMap<int> map;
  std::unordered_map<Coord, int, CoordHash> expected;
  for (int i = 0; i < 20'000; ++i) {
    const Coord at{along(random), along(random), along(random)};
    const int what = action(random);
    if (what < 5) {
      const auto [value, fresh] = map.insert(at);
      const auto [there, new_there] = expected.try_emplace(at, 0);
      ASSERT_EQ(fresh, new_there);
      ASSERT_EQ(*value, there->second);
      *value = there->second = i;
    } else {
      map.erase(at);
      expected.erase(at);
    }
    ASSERT_EQ(map.size(), expected.size());
    if (i % 100 != 0) continue;
    for (std::int32_t x = -4; x <= 4; ++x)
      for (std::int32_t y = -4; y <= 4; ++y)
        for (std::int32_t z = -4; z <= 4; ++z) {
          const auto there = expected.find({x, y, z});
          const int* const found = map.find({x, y, z});
          ASSERT_EQ(found != nullptr, there != expected.end());
          if (found) {
            ASSERT_EQ(*found, there->second);
          }
        }
  }
  map.clear();
  EXPECT_TRUE(map.empty());
  EXPECT_EQ(map.find({0, 0, 0}), nullptr);
  EXPECT_EQ(map[Coord(0, 0, 0)], 0);
}

TEST(CoordMap, FindsCoordinatesFarApart) {
  CoordMap<std::int32_t> map;
  map.reserve(100);
  for (std::int32_t i = 0; i < 100; ++i) map[{i << 24, -i, i << 8}] = i;
  for (std::int32_t i = 0; i < 100; ++i) {
    const std::int32_t* const found = map.find({i << 24, -i, i << 8});
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(*found, i);
  }
  EXPECT_EQ(map.find({1, 2, 3}), nullptr);
}

TEST(CoordMap, LetsGoOfWhatItDiscards) {
  CoordMap<std::shared_ptr<int>> map;
  const auto kept = std::make_shared<int>(1);
  for (std::int32_t i = 0; i < 50; ++i) map[{i, 0, 0}] = kept;
  EXPECT_EQ(kept.use_count(), 51);
  for (std::int32_t i = 0; i < 20; ++i) map.erase({i, 0, 0});
  EXPECT_EQ(kept.use_count(), 31);
  map.clear();
  EXPECT_EQ(kept.use_count(), 1);
}

}  // namespace
}  // namespace osteon
