// The cases that rooms can be of. Those that were uploaded are in memory only as long as a room has them, and all
// together within a limit: what strangers' cases take is decided by whoever runs the server.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/volume/case.hpp"

namespace osteon {

inline constexpr std::uint64_t kMostCaseMemory = std::uint64_t{8} << 30;  // bytes, unless somebody says otherwise

struct ServedCase {
  Case bone;
  std::filesystem::path folder;  // that clients are sent
};

// What is known of a case that may not be in memory.
struct KnownCase {
  Digest hash;
  std::string title;
  std::filesystem::path folder;
  std::uint64_t memory_bytes = 0;  // that it takes; 0: that shows when it is loaded
};

// In memory for as long as somebody has it.
struct LoadedCase {
  std::shared_ptr<const Case> bone;  // shared by the rooms of it
  std::filesystem::path folder;
};

// Any thread.
class CaseCache {
 public:
  // `most_bytes`: of all that are in memory at once.
  explicit CaseCache(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  void keep(ServedCase served);  // in memory as long as this is
  void add(KnownCase known);     // one of a hash that is known stays as it is
  [[nodiscard]] std::optional<KnownCase> find(const Digest& hash) const;
  [[nodiscard]] std::vector<KnownCase> all() const;  // in the order of their hashes
  // Reads it from its folder where nobody has it, one at a time. Errors: not_found, exhausted (with it, the cases in
  // memory would take more than they may), and those of Case::load().
  [[nodiscard]] Result<LoadedCase> load(const Digest& hash);
  [[nodiscard]] std::uint64_t loaded_bytes() const;

 private:
  struct Entry {
    KnownCase known;
    std::shared_ptr<const Case> kept;  // shared with its rooms; null: only they have it
    std::weak_ptr<const Case> loaded;
  };
  [[nodiscard]] std::uint64_t loaded_locked() const;                                          // under mutex_
  [[nodiscard]] Result<void> check_space(const KnownCase& known, std::uint64_t bytes) const;  // likewise

  const std::uint64_t most_bytes_;
  std::mutex loading_;  // taken before mutex_, never within it
  mutable std::mutex mutex_;
  std::map<Digest, Entry> entries_;
};

}  // namespace osteon
