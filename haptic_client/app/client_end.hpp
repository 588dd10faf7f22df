// Why a haptic client ends before its session is done. Any thread.
#pragma once
#include <atomic>
#include <optional>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"

namespace osteon::haptic {

class ClientEnd {
 public:
  // Spindle and force run down, and the client ends with the first reason given. Locks.
  void give_up(const Error& why) {
    const MutexLock lock(mutex_);
    if (!why_) why_ = why;
    lost_ = true;
  }
  // True once a reason was given. Never waits, so the haptic thread may ask.
  [[nodiscard]] bool lost() const noexcept { return lost_.load(std::memory_order_acquire); }
  // The reason, if one was given. Locks.
  [[nodiscard]] std::optional<Error> why() const {
    const MutexLock lock(mutex_);
    return why_;
  }

 private:
  std::atomic<bool> lost_{false};
  mutable Mutex mutex_{LockRank::leaf};
  std::optional<Error> why_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon::haptic
