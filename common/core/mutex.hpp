// Locks that clang checks at compile time: a guarded member is used only under its lock. Builds with
// OSTEON_CHECK_LOCK_ORDER also check at run time that every thread takes locks in the order of LockRank.
#pragma once
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <shared_mutex>
#include <utility>

#include "common/core/lock_rank.hpp"
#include "common/core/thread_annotations.hpp"

namespace osteon {

// The ranks of the locks that one thread holds. Used by that thread alone. A violation of the order prints the names of
// both ranks and aborts.
class HeldLocks {
 public:
  static constexpr std::size_t kMost = 16;  // the deepest nesting

  void expect(LockRank next) const noexcept;  // that a thread may wait for a lock of this rank now
  void expect_held(LockRank rank) const noexcept;
  void add(LockRank taken) noexcept;
  void remove(LockRank released) noexcept;

 private:
  std::array<LockRank, kMost> held_{};
  std::size_t count_ = 0;
};

namespace core {
[[nodiscard]] HeldLocks& held_locks() noexcept;  // of the calling thread

#ifdef OSTEON_CHECK_LOCK_ORDER
inline constexpr bool kCheckLockOrder = true;
#else
inline constexpr bool kCheckLockOrder = false;
#endif

// The rank of a lock, and its check.
class Ranked {
 public:
  constexpr explicit Ranked(LockRank rank) : rank_(rank) {}
  Ranked(const Ranked&) = delete;
  Ranked& operator=(const Ranked&) = delete;

 protected:
  // Checked before the thread waits, so that a violation is reported and not a deadlock.
  void expect() const {
    if constexpr (kCheckLockOrder) held_locks().expect(rank_);
  }
  void expect_held() const {
    if constexpr (kCheckLockOrder) held_locks().expect_held(rank_);
  }
  void note_taken() const {
    if constexpr (kCheckLockOrder) held_locks().add(rank_);
  }
  void note_released() const {
    if constexpr (kCheckLockOrder) held_locks().remove(rank_);
  }

 private:
  const LockRank rank_;
};
}  // namespace core

// Any thread may take it; the thread that took it releases it.
class OSTEON_CAPABILITY("mutex") Mutex : core::Ranked {
 public:
  using Ranked::Ranked;
  void lock() OSTEON_ACQUIRE() {
    expect();
    native_.lock();
    note_taken();
  }
  void unlock() OSTEON_RELEASE() {
    native_.unlock();
    note_released();
  }
  // Never waits, so it may be called in any order.
  [[nodiscard]] bool try_lock() OSTEON_TRY_ACQUIRE(true) {
    const bool taken = native_.try_lock();
    if (taken) note_taken();
    return taken;
  }
  // Tells clang that the calling thread holds it, where a callback hides that.
  void assert_held() const OSTEON_ASSERT_CAPABILITY(this) { expect_held(); }

 private:
  friend class CondVar;
  std::mutex native_;
};

// Many readers, or one writer.
class OSTEON_CAPABILITY("shared mutex") SharedMutex : core::Ranked {
 public:
  using Ranked::Ranked;
  void lock() OSTEON_ACQUIRE() {
    expect();
    native_.lock();
    note_taken();
  }
  void unlock() OSTEON_RELEASE() {
    native_.unlock();
    note_released();
  }
  void lock_shared() OSTEON_ACQUIRE_SHARED() {
    expect();
    native_.lock_shared();
    note_taken();
  }
  void unlock_shared() OSTEON_RELEASE_SHARED() {
    native_.unlock_shared();
    note_released();
  }

 private:
  std::shared_mutex native_;
};

// Holds a mutex while it lives, except between unlock() and lock().
class OSTEON_SCOPED_CAPABILITY MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) OSTEON_ACQUIRE(mutex) : mutex_(mutex) { mutex_.lock(); }
  // The calling thread holds it already.
  MutexLock(Mutex& mutex, std::adopt_lock_t) OSTEON_REQUIRES(mutex) : mutex_(mutex) {}
  ~MutexLock() OSTEON_RELEASE() {
    if (holds_) mutex_.unlock();
  }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

  void lock() OSTEON_ACQUIRE() {
    mutex_.lock();
    holds_ = true;
  }
  void unlock() OSTEON_RELEASE() {
    mutex_.unlock();
    holds_ = false;
  }

 private:
  friend class CondVar;
  Mutex& mutex_;
  bool holds_ = true;
};

// Holds a shared mutex for reading while it lives.
class OSTEON_SCOPED_CAPABILITY ReaderLock {
 public:
  explicit ReaderLock(SharedMutex& mutex) OSTEON_ACQUIRE_SHARED(mutex) : mutex_(mutex) { mutex_.lock_shared(); }
  ~ReaderLock() OSTEON_RELEASE() { mutex_.unlock_shared(); }
  ReaderLock(const ReaderLock&) = delete;
  ReaderLock& operator=(const ReaderLock&) = delete;

 private:
  SharedMutex& mutex_;
};

// Holds a shared mutex for writing while it lives.
class OSTEON_SCOPED_CAPABILITY WriterLock {
 public:
  explicit WriterLock(SharedMutex& mutex) OSTEON_ACQUIRE(mutex) : mutex_(mutex) { mutex_.lock(); }
  ~WriterLock() OSTEON_RELEASE() { mutex_.unlock(); }
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  SharedMutex& mutex_;
};

// Waits under a lock. A wait may end without a reason, so callers wait in a loop:
//   while (!ready_) wake_.wait(lock);
// A timed wait may take a condition. Clang analyses a lambda as a function of its own, so its lock is named:
//   wake_.wait_for(lock, time, [this]() OSTEON_REQUIRES(mutex_) { return ready_; });
class CondVar {
 public:
  void notify_one() noexcept { native_.notify_one(); }
  void notify_all() noexcept { native_.notify_all(); }

  void wait(MutexLock& lock) {
    Waiting waiting(lock);
    native_.wait(waiting.lock);
  }
  template <class Clock, class Duration>
  std::cv_status wait_until(MutexLock& lock, const std::chrono::time_point<Clock, Duration>& until) {
    Waiting waiting(lock);
    return native_.wait_until(waiting.lock, until);
  }
  template <class Rep, class Period>
  std::cv_status wait_for(MutexLock& lock, const std::chrono::duration<Rep, Period>& time) {
    Waiting waiting(lock);
    return native_.wait_for(waiting.lock, time);
  }
  // These return the condition at the end. Not analysed, since `lock` is not known here as the lock of `condition`.
  template <class Clock, class Duration, class Condition>
  bool wait_until(MutexLock& lock, const std::chrono::time_point<Clock, Duration>& until,
                  Condition condition) OSTEON_NO_THREAD_SAFETY_ANALYSIS {
    Waiting waiting(lock);
    return native_.wait_until(waiting.lock, until, std::move(condition));
  }
  template <class Rep, class Period, class Condition>
  bool wait_for(MutexLock& lock, const std::chrono::duration<Rep, Period>& time,
                Condition condition) OSTEON_NO_THREAD_SAFETY_ANALYSIS {
    Waiting waiting(lock);
    return native_.wait_for(waiting.lock, time, std::move(condition));
  }

 private:
  // Lends the native mutex to the native condition variable. The lock counts as held while the thread waits.
  struct Waiting {
    explicit Waiting(MutexLock& held) : lock(held.mutex_.native_, std::adopt_lock) {}
    ~Waiting() { lock.release(); }
    std::unique_lock<std::mutex> lock;
  };

  std::condition_variable native_;
};

}  // namespace osteon
