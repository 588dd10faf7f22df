#include "server/net/refusals.hpp"

#include <string>

#include "common/runtime/log.hpp"

namespace osteon {

void RefusalCounts::note(std::string_view reason, std::string_view who, std::string_view said, std::string_view from) {
  count(reason);
  {
    const std::lock_guard lock(mutex_);
    if (!log_.is_new(std::string(who) + " " + std::string(from), reason)) return;
  }
  if (from.empty())
    log::warn("refused", {{"who", who}, {"reason", reason}, {"said", said}});
  else
    log::warn("refused", {{"who", who}, {"from", from}, {"reason", reason}, {"said", said}});
}

}  // namespace osteon
