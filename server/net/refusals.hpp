// Who and what was refused: counted by reason for the metrics, and logged.
#pragma once
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "server/net/refusal_log.hpp"

namespace osteon {

// Any thread. A reason is a fixed word such as "version" or "ticket", never a caller's text: memory stays bounded, and
// what comes after the first kMost different ones counts as "other".
class RefusalCounts {
 public:
  static constexpr std::size_t kMost = 32;
  void count(std::string_view reason) {
    const std::lock_guard lock(mutex_);
    const auto known = counts_.find(reason);
    if (known != counts_.end())
      ++known->second;
    else
      ++counts_[counts_.size() < kMost ? std::string(reason) : "other"];
  }
  // Counts it, and logs it: once for each `who`, a person or an address, `from` and reason, and by RefusalLog's limit,
  // so that nobody fills the disk. `from`: the address of a person; empty: it is not known, or `who` is one.
  void note(std::string_view reason, std::string_view who, std::string_view said, std::string_view from = {});
  [[nodiscard]] std::map<std::string, std::uint64_t, std::less<>> counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t, std::less<>> counts_;
  RefusalLog log_;
};

}  // namespace osteon
