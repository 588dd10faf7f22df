// The cases that rooms can use. Uploaded cases are in memory only while a room uses them, and all cases together stay
// within a limit. So whoever runs the server decides how much memory the cases of other people may take.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "common/volume/case.hpp"

namespace osteon {

inline constexpr std::uint64_t kMostCaseMemory = std::uint64_t{8} << 30;  // bytes, default

struct ServedCase {
  Case bone;
  std::filesystem::path folder;  // sent to clients
};

// What is known of a case, whether it is in memory or not.
struct KnownCase {
  Digest hash;
  std::string title;
  std::filesystem::path folder;
  std::uint64_t memory_bytes = 0;  // memory that it needs; 0: known only after loading
};

// A case that stays in memory while somebody holds this.
struct LoadedCase {
  std::shared_ptr<const Case> bone;  // shared by the rooms of the case
  std::filesystem::path folder;
};

// Any thread may call it.
class CaseCache {
 public:
  // `most_bytes`: limit of all cases in memory together.
  explicit CaseCache(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  void keep(ServedCase served);  // stays in memory as long as the cache
  void add(KnownCase known);     // if its hash is known already, nothing changes
  [[nodiscard]] std::optional<KnownCase> find(const Digest& hash) const;
  [[nodiscard]] std::vector<KnownCase> all() const;  // in order of their hashes
  // Reads the case from its folder if nobody holds it. One case is read at a time. Errors: not_found; exhausted (the
  // cases in memory would exceed the limit); and those of Case::load().
  [[nodiscard]] Result<LoadedCase> load(const Digest& hash);
  [[nodiscard]] std::uint64_t loaded_bytes() const;

 private:
  struct Entry {
    KnownCase known;
    std::shared_ptr<const Case> kept;  // shared with its rooms; null: only its rooms hold it
    std::weak_ptr<const Case> loaded;
  };
  [[nodiscard]] std::uint64_t loaded_locked() const OSTEON_REQUIRES(mutex_);
  [[nodiscard]] Result<void> check_space(const KnownCase& known, std::uint64_t bytes) const OSTEON_REQUIRES(mutex_);

  const std::uint64_t most_bytes_;
  Mutex loading_{LockRank::case_loading};  // held while a case is read, so that one is read at a time
  mutable Mutex mutex_{LockRank::leaf};
  std::map<Digest, Entry> entries_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
