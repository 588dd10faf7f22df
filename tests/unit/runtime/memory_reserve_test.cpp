// The pages that a thread waits for, with a memory reserve and without one.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "common/runtime/memory_reserve.hpp"

namespace osteon {
namespace {

long pages_waited_for() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

// Allocates small blocks, as the leaves of a cut field are, and writes all of each. Returns the number of pages that
// the system had to provide.
long pages_for_blocks(std::vector<std::unique_ptr<char[]>>& kept, int count) {
  constexpr std::size_t kBlock = 2048;
  const long before = pages_waited_for();
  for (int i = 0; i < count; ++i) {
    kept.push_back(std::make_unique<char[]>(kBlock));
    std::memset(kept.back().get(), i, kBlock);
  }
  return pages_waited_for() - before;
}

TEST(MemoryReserve, SmallBlocksNeedNoNewPagesAfterARefill) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer replaces the system's heap, which the reserve uses";
#endif
  constexpr int kBlocks = 512;  // 1 MB
  // In a thread of its own, so that its part of the heap has no freed memory.
  long without = 0, with = 0, again = 0;
  std::thread([&] {
    std::vector<std::unique_ptr<char[]>> kept;
    kept.reserve(4 * kBlocks);
    without = pages_for_blocks(kept, kBlocks);
    MemoryReserve reserve(4 << 20);
    with = pages_for_blocks(kept, kBlocks);
    reserve.refill();
    again = pages_for_blocks(kept, kBlocks);
  }).join();
  EXPECT_GT(without, 200);
  EXPECT_LT(with, 10);
  EXPECT_LT(again, 10);
}

}  // namespace
}  // namespace osteon
