#include "common/core/mutex.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace osteon {
namespace {

const char* name_of(LockRank rank) {
  static constexpr const char* kNames[] = {
#define OSTEON_LOCK_RANK(name) #name,
      OSTEON_LOCK_RANKS(OSTEON_LOCK_RANK)
#undef OSTEON_LOCK_RANK
  };
  return kNames[static_cast<std::size_t>(rank)];
}

[[noreturn]] void fail(const char* what, LockRank rank, LockRank held) {
  std::fprintf(stderr, "lock order violated: %s %s (rank %d) while %s (rank %d) is held\n", what, name_of(rank),
               static_cast<int>(rank), name_of(held), static_cast<int>(held));
  std::abort();
}

[[noreturn]] void fail_without(LockRank rank) {
  std::fprintf(stderr, "lock order violated: this thread does not hold %s (rank %d)\n", name_of(rank),
               static_cast<int>(rank));
  std::abort();
}

}  // namespace

void HeldLocks::expect(LockRank next) const noexcept {
  for (std::size_t i = 0; i < count_; ++i)
    if (held_[i] >= next) fail("taking", next, held_[i]);
}

void HeldLocks::expect_held(LockRank rank) const noexcept {
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count_);
  if (std::find(held_.begin(), end, rank) == end) fail_without(rank);
}

void HeldLocks::add(LockRank taken) noexcept {
  if (count_ == kMost) fail("too many locks: taking", taken, held_.back());
  held_[count_++] = taken;
}

void HeldLocks::remove(LockRank released) noexcept {
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto found = std::find(held_.begin(), end, released);
  if (found == end) fail_without(released);
  std::move(found + 1, end, found);
  --count_;
}

HeldLocks& core::held_locks() noexcept {
  thread_local HeldLocks held;
  return held;
}

}  // namespace osteon
