#include "server/auth/refusals.hpp"

#include <string>

#include "common/runtime/log.hpp"

namespace osteon {

void RefusalCounts::note(std::string_view reason, std::string_view who, std::string_view said, std::string_view from) {
  count(reason);
  std::uint64_t left_out = 0;
  {
    const MutexLock lock(mutex_);
    if (!log_.is_new(std::string(who) + " " + std::string(from), reason)) return;
    left_out = log_.take_left_out();
  }
  if (left_out > 0) log::warn("refusals were not logged, since there were too many", {{"count", left_out}});
  if (from.empty())
    log::warn("refused", {{"who", who}, {"reason", reason}, {"said", said}});
  else
    log::warn("refused", {{"who", who}, {"from", from}, {"reason", reason}, {"said", said}});
}

}  // namespace osteon
