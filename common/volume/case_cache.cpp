#include "common/volume/case_cache.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

namespace osteon {
namespace {

namespace fs = std::filesystem;

Error cannot_keep(const fs::path& path, const std::string& why) {
  return {ErrorCode::internal, "cannot store the case in the cache: " + path.string() + ": " + why};
}

// The folder into which a case is fetched. It is removed unless it was moved to its final path.
class PartialFolder {
 public:
  explicit PartialFolder(fs::path path) : path_(std::move(path)) {}
  ~PartialFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// No other process or thread has the same.
std::string part_name(const Digest& hash) {
  static std::atomic<unsigned> parts{0};
  return to_hex(hash) + ".part-" + std::to_string(::getpid()) + "-" + std::to_string(++parts);
}

}  // namespace

fs::path default_case_cache() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return fs::path(cache) / "osteon" / "cases";
  if (const char* home = std::getenv("HOME"); home && *home) return fs::path(home) / ".cache" / "osteon" / "cases";
  return fs::temp_directory_path() / "osteon" / "cases";
}

Result<Case> cached_case(const fs::path& cache, const Digest& hash,
                         const std::function<Result<void>(const fs::path& folder)>& fetch) {
  const fs::path place = cache / to_hex(hash);
  if (Result<Case> kept = Case::load(place); kept && kept->hash() == hash) return kept;

  const PartialFolder part(cache / part_name(hash));
  std::error_code error;
  fs::remove_all(part.path(), error);
  fs::create_directories(part.path(), error);
  if (error) return tl::unexpected(cannot_keep(part.path(), error.message()));
  if (const Result<void> received = fetch(part.path()); !received) return tl::unexpected(received.error());
  Result<Case> fetched = Case::load(part.path());
  if (!fetched) return fetched;
  if (fetched->hash() != hash)
    return failure(ErrorCode::invalid_input,
                   "the server sent the case " + to_hex(fetched->hash()) + " where " + to_hex(hash) + " was announced");

  // A damaged folder is replaced. A folder that another client has put there in the meantime is as good as ours.
  fs::rename(part.path(), place, error);
  if (error) {
    if (const Result<Case> other = Case::load(place); other && other->hash() == hash) return fetched;
    fs::remove_all(place, error);
    fs::rename(part.path(), place, error);
    if (error) return tl::unexpected(cannot_keep(place, error.message()));
  }
  return fetched;
}

}  // namespace osteon
