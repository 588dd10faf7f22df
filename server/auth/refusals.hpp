// Counts refusals by reason for the metrics, and logs them.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "common/core/mutex.hpp"
#include "server/auth/refusal_log.hpp"

namespace osteon {

// Any thread may call it. A reason is a fixed word such as "version" or "ticket", never a caller's text, so memory
// stays bounded. Reasons after the first kMost different ones count as "other".
class RefusalCounts {
 public:
  static constexpr std::size_t kMost = 32;
  void count(std::string_view reason) {
    const MutexLock lock(mutex_);
    const auto known = counts_.find(reason);
    if (known != counts_.end())
      ++known->second;
    else
      ++counts_[counts_.size() < kMost ? std::string(reason) : "other"];
  }
  // Counts a refusal and logs it once for each `who`, `from` and reason, within the limit of RefusalLog, so that nobody
  // can fill the disk. `who`: a person or an address. `from`: the address of a person; empty if it is unknown or `who`
  // is an address.
  void note(std::string_view reason, std::string_view who, std::string_view said, std::string_view from = {});
  [[nodiscard]] std::map<std::string, std::uint64_t, std::less<>> counts() const {
    const MutexLock lock(mutex_);
    return counts_;
  }

 private:
  mutable Mutex mutex_{LockRank::leaf};
  std::map<std::string, std::uint64_t, std::less<>> counts_ OSTEON_GUARDED_BY(mutex_);
  RefusalLog log_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
