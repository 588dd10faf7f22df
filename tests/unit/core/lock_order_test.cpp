// Tests that locks check their order. This program is always compiled with OSTEON_CHECK_LOCK_ORDER.
#include <gtest/gtest.h>

#include <chrono>

#include "common/core/mutex.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

static_assert(core::kCheckLockOrder);

class LockOrder : public ::testing::Test {
 protected:
  SharedMutex room_{LockRank::room};
  Mutex stream_{LockRank::stream}, leaf_{LockRank::leaf};
};

TEST_F(LockOrder, TheRightOneIsTaken) {
  for (int i = 0; i < 2; ++i) {  // what was released may be taken again
    const ReaderLock reading(room_);
    const MutexLock stream(stream_);
    const MutexLock leaf(leaf_);
  }
  const WriterLock writing(room_);
  MutexLock leaf(leaf_);
  leaf.unlock();
  const MutexLock stream(stream_);
}

TEST_F(LockOrder, TheWrongOneEndsTheProgram) {
  EXPECT_DEATH(
      {
        const MutexLock leaf(leaf_);
        const MutexLock stream(stream_);
      },
      "taking stream .* while leaf .* is held");
  EXPECT_DEATH(
      {
        const MutexLock leaf(leaf_);
        const WriterLock writing(room_);
      },
      "taking room .* while leaf .* is held");
  EXPECT_DEATH(
      {
        const MutexLock stream(stream_);
        const ReaderLock reading(room_);
      },
      "taking room .* while stream .* is held");
}

// It never waits. But the next lock must come after it.
TEST_F(LockOrder, TryLockMayBeCalledInAnyOrder) {
  const MutexLock leaf(leaf_);
  ASSERT_TRUE(stream_.try_lock());
  const MutexLock adopted(stream_, std::adopt_lock);
  EXPECT_DEATH(const MutexLock again(leaf_), "taking leaf .* while leaf .* is held");
}

TEST_F(LockOrder, ALockIsHeldWhileItsThreadWaits) {
  CondVar never;
  MutexLock leaf(leaf_);
  EXPECT_EQ(never.wait_for(leaf, 1ms), std::cv_status::timeout);
  leaf_.assert_held();
  EXPECT_DEATH(const MutexLock stream(stream_), "taking stream .* while leaf .* is held");
  leaf.unlock();
  EXPECT_DEATH(leaf_.assert_held(), "does not hold leaf");
}

}  // namespace
}  // namespace osteon
