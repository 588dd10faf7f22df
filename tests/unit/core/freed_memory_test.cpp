// Memory that goes back to Linux.
#include "common/core/freed_memory.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace osteon {
namespace {

// Asked of Linux: how many whole pages of the vector's memory are in use.
std::size_t pages_in_use(const std::vector<std::int16_t>& values) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(values.data());
  const std::uintptr_t first = (begin + page - 1) / page * page,
                       last = (begin + values.capacity() * sizeof(std::int16_t)) / page * page;
  std::vector<unsigned char> used((last - first) / page);
  EXPECT_EQ(::mincore(reinterpret_cast<void*>(first), last - first, used.data()), 0);
  return static_cast<std::size_t>(std::ranges::count_if(used, [](unsigned char u) { return (u & 1) != 0; }));
}

TEST(FreedMemory, AShorterVectorKeepsItsValuesAndGivesBackTheRest) {
  std::vector<std::int16_t> values(1 << 20, 7);
  const std::size_t whole = pages_in_use(values);
  const std::int16_t* const place = values.data();
  values.resize(values.size() / 4);
  give_back_unused(values);
  EXPECT_EQ(values.data(), place) << "no copy";
  EXPECT_TRUE(std::ranges::all_of(values, [](std::int16_t v) { return v == 7; }));
  EXPECT_LE(pages_in_use(values), whole / 4 + 1);
  values.resize(1 << 20, 9);  // within its memory
  EXPECT_EQ(values.back(), 9);
}

TEST(FreedMemory, AFullOrEmptyVectorStaysAsItIs) {
  std::vector<std::int16_t> full{1, 2, 3}, empty;
  give_back_unused(full);
  give_back_unused(empty);
  EXPECT_EQ(full, (std::vector<std::int16_t>{1, 2, 3}));
  EXPECT_TRUE(empty.empty());
}

}  // namespace
}  // namespace osteon
