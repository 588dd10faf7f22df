#include "server/net/refusals.hpp"

#include "common/runtime/log.hpp"

namespace osteon {

void RefusalCounts::note(std::string_view reason, std::string_view who, std::string_view said) {
  count(reason);
  {
    const std::lock_guard lock(mutex_);
    if (!log_.is_new(who, reason)) return;
  }
  log::warn("refused", {{"who", who}, {"reason", reason}, {"said", said}});
}

std::string address_of(std::string_view peer) {
  const std::size_t port = peer.rfind(':');
  return std::string(port == std::string_view::npos || port <= peer.find(':') ? peer : peer.substr(0, port));
}

}  // namespace osteon
