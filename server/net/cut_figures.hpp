// How long cuts take on their way through a room, stage by stage, and why some are not taken.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <mutex>

#include "common/field/rejection.hpp"
#include "common/runtime/tick_stats.hpp"

namespace osteon {

// What a cut that was committed has waited for on its way through a room, one after the other.
struct StageTimes {
  DurationHistogram wait;    // from its arrival until the tick took it
  DurationHistogram decide;  // judged and applied
  DurationHistogram commit;  // until it was durable; short where nothing is kept
  DurationHistogram tell;    // until every session had been handed it
};
using RejectionCounts = std::array<std::uint64_t, kRejections>;  // by the reason's number

class CutFigures {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // [tick]
  void committed(Time arrived, Time taken, Time decided);
  void rejected(Rejection reason) { ++own_.rejections.at(static_cast<std::size_t>(reason)); }
  // [tick] Lets others see it, unless one of them is reading just now; the `last` time in any case.
  void publish(bool last);
  // [committing thread]
  void told(Time decided, Time kept, Time told);

  [[nodiscard]] StageTimes stages() const;
  [[nodiscard]] RejectionCounts rejections() const;

 private:
  struct OfTick {
    DurationHistogram wait, decide;
    RejectionCounts rejections{};
  };
  OfTick own_;  // of the tick thread
  mutable std::mutex mutex_;
  OfTick shown_;
  DurationHistogram commit_, tell_;
};

}  // namespace osteon
