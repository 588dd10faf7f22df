// Measures how long cuts take in each stage of a room, and counts why cuts are rejected.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>

#include "common/core/mutex.hpp"
#include "common/field/rejection.hpp"
#include "common/runtime/tick_stats.hpp"

namespace osteon {

// The times that a committed cut takes in a room, one stage after the other.
struct StageTimes {
  DurationHistogram wait;     // from its arrival until the tick took it
  DurationHistogram decide;   // to judge and apply it
  DurationHistogram commit;   // until it was durable; short if nothing is written
  DurationHistogram publish;  // until it was handed to every session
};
using RejectionCounts = std::array<std::uint64_t, kRejections>;  // by the number of the reason

class CutMetrics {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // [tick]
  void committed(Time arrived, Time taken, Time decided);
  void rejected(Rejection reason) { ++own_.rejections.at(static_cast<std::size_t>(reason)); }
  // [tick] Makes the numbers visible to readers, unless one is reading at this moment. With `last` it always does.
  void publish(bool last);
  // [committing thread]
  void acknowledged(Time decided, Time durable, Time acknowledged);

  [[nodiscard]] StageTimes stages() const;
  [[nodiscard]] RejectionCounts rejections() const;

 private:
  struct OfTick {
    DurationHistogram wait, decide;
    RejectionCounts rejections{};
  };
  OfTick own_;  // of the tick thread
  mutable Mutex mutex_{LockRank::leaf};
  OfTick shown_ OSTEON_GUARDED_BY(mutex_);
  DurationHistogram commit_ OSTEON_GUARDED_BY(mutex_), publish_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
