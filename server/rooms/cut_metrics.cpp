#include "server/rooms/cut_metrics.hpp"

namespace osteon {

void CutMetrics::committed(Time arrived, Time taken, Time decided) {
  own_.wait.record(taken - arrived);
  own_.decide.record(decided - taken);
}

void CutMetrics::publish(bool last) {
  if (last)
    mutex_.lock();
  else if (!mutex_.try_lock())
    return;
  const MutexLock lock(mutex_, std::adopt_lock);
  shown_ = own_;
}

void CutMetrics::acknowledged(Time decided, Time durable, Time acknowledged) {
  const MutexLock lock(mutex_);
  commit_.record(durable - decided);
  publish_.record(acknowledged - durable);
}

StageTimes CutMetrics::stages() const {
  const MutexLock lock(mutex_);
  return {shown_.wait, shown_.decide, commit_, publish_};
}

RejectionCounts CutMetrics::rejections() const {
  const MutexLock lock(mutex_);
  return shown_.rejections;
}

}  // namespace osteon
