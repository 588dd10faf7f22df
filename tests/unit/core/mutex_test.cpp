#include "common/core/mutex.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace osteon {
namespace {

using namespace std::chrono_literals;

TEST(HeldLocks, MayBeTakenInTheOrderOfTheRanks) {
  HeldLocks held;
  held.expect(LockRank::rooms_changing);
  held.add(LockRank::rooms_changing);
  held.expect(LockRank::room);
  held.add(LockRank::room);
  held.expect_held(LockRank::rooms_changing);
  held.expect(LockRank::leaf);
  held.add(LockRank::leaf);
  held.remove(LockRank::leaf);
  held.expect(LockRank::sessions);
}

// Locks need not be released in the reverse order.
TEST(HeldLocks, MayBeReleasedInAnyOrder) {
  HeldLocks held;
  held.add(LockRank::room);
  held.add(LockRank::sessions);
  held.remove(LockRank::room);
  held.expect_held(LockRank::sessions);
  held.remove(LockRank::sessions);
  held.expect(LockRank::health);
}

// A try_lock may take a lock out of order, since it does not wait. The next lock must come after both.
TEST(HeldLocks, CountTheHighestRank) {
  HeldLocks held;
  held.add(LockRank::stream);
  held.add(LockRank::room);
  held.expect(LockRank::leaf);
  EXPECT_DEATH(held.expect(LockRank::sessions), "taking sessions .* while stream .* is held");
}

TEST(HeldLocks, RefuseTheWrongOrderByName) {
  HeldLocks held;
  held.add(LockRank::sessions);
  EXPECT_DEATH(held.expect(LockRank::room),
               "lock order violated: taking room \\(rank [0-9]+\\) while sessions \\(rank [0-9]+\\)");
}

TEST(HeldLocks, RefuseASecondLockOfOneRank) {
  HeldLocks held;
  held.add(LockRank::leaf);
  EXPECT_DEATH(held.expect(LockRank::leaf), "taking leaf .* while leaf .* is held");
}

TEST(HeldLocks, RefuseWhatIsNotHeld) {
  HeldLocks held;
  EXPECT_DEATH(held.remove(LockRank::room), "does not hold room");
  EXPECT_DEATH(held.expect_held(LockRank::room), "does not hold room");
}

TEST(Mutex, IsTakenByOneThreadAtATime) {
  Mutex mutex(LockRank::leaf);
  int count = 0;
  const auto work = [&] {
    for (int i = 0; i < 10'000; ++i) {
      const MutexLock lock(mutex);
      ++count;
    }
  };
  std::thread other(work);
  work();
  other.join();
  EXPECT_EQ(count, 20'000);
}

TEST(Mutex, IsNotTakenTwice) {
  Mutex mutex(LockRank::leaf);
  MutexLock lock(mutex);
  bool taken = true;
  std::thread([&] {
    taken = mutex.try_lock();
    if (taken) mutex.unlock();
  }).join();
  EXPECT_FALSE(taken);
  lock.unlock();
  ASSERT_TRUE(mutex.try_lock());
  const MutexLock adopted(mutex, std::adopt_lock);
}

TEST(CondVar, PassesAValueOn) {
  Mutex mutex(LockRank::leaf);
  CondVar changed;
  int value = 0;
  std::thread other([&] {
    MutexLock lock(mutex);
    while (value != 1) changed.wait(lock);
    value = 2;
    changed.notify_all();
  });
  MutexLock lock(mutex);
  value = 1;
  changed.notify_all();
  EXPECT_TRUE(changed.wait_for(lock, 10s, [&] { return value == 2; }));
  EXPECT_FALSE(changed.wait_until(lock, std::chrono::steady_clock::now() + 1ms, [&] { return value == 3; }));
  EXPECT_EQ(changed.wait_for(lock, 0ms), std::cv_status::timeout);
  lock.unlock();
  other.join();
}

}  // namespace
}  // namespace osteon
