#include "server/net/cut_figures.hpp"

namespace osteon {

void CutFigures::committed(Time arrived, Time taken, Time decided) {
  own_.wait.record(taken - arrived);
  own_.decide.record(decided - taken);
}

void CutFigures::publish(bool last) {
  std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock && last) lock.lock();
  if (lock) shown_ = own_;
}

void CutFigures::told(Time decided, Time kept, Time told) {
  const std::lock_guard lock(mutex_);
  commit_.record(kept - decided);
  tell_.record(told - kept);
}

StageTimes CutFigures::stages() const {
  const std::lock_guard lock(mutex_);
  return {shown_.wait, shown_.decide, commit_, tell_};
}

RejectionCounts CutFigures::rejections() const {
  const std::lock_guard lock(mutex_);
  return shown_.rejections;
}

}  // namespace osteon
