#include "common/core/sparse_bytes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>

namespace osteon {
namespace {

// Lengths around the ends of words and blocks, with none, few and all bytes that are not 0.
TEST(SparseBytes, GivesTheBytesBack) {
  std::mt19937 random(5);
  for (const std::size_t size : {0, 1, 63, 64, 65, 255, 256, 257, 1000})
    for (const double share : {0.0, 0.03, 0.5, 1.0}) {
      std::vector<std::uint8_t> bytes(size), values;
      for (std::uint8_t& byte : bytes)
        if (static_cast<double>(random() % 1000) < 1000.0 * share) byte = static_cast<std::uint8_t>(1 + random() % 255);
      std::ranges::copy_if(bytes, std::back_inserter(values), [](std::uint8_t byte) { return byte != 0; });
      const SparseBytes sparse(bytes);
      ASSERT_EQ(sparse.size(), size);
      EXPECT_EQ(sparse.empty(), size == 0);
      for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(sparse[i], bytes[i]) << i << " of " << size;
      EXPECT_TRUE(std::ranges::equal(sparse.values(), values));
      EXPECT_EQ(sparse.dense(), bytes);
    }
}

TEST(SparseBytes, AreEqualIfAllBytesAre) {
  const std::vector<std::uint8_t> bytes{0, 3, 0}, moved{3, 0, 0}, longer{0, 3, 0, 0}, other{0, 4, 0};
  EXPECT_EQ(SparseBytes(bytes), SparseBytes(bytes));
  for (const auto& different : {moved, longer, other}) EXPECT_NE(SparseBytes(bytes), SparseBytes(different));
}

}  // namespace
}  // namespace osteon
