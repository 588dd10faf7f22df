// What windows leave behind in the user's folders: unpacked case files that no session needs, and unfinished work of
// programs that were killed.
#pragma once
#include <filesystem>
#include <memory>

#include "viewer_client/desktop/file_lock.hpp"

namespace osteon {

// Each open window has one. A window removes the stale files when it opens and when it closes, unless another one is
// open.
class StaleFiles {
 public:
  // `sockets`: the folder of the windows' sockets.
  explicit StaleFiles(std::filesystem::path sockets);
  ~StaleFiles();
  StaleFiles(const StaleFiles&) = delete;
  StaleFiles& operator=(const StaleFiles&) = delete;

 private:
  void remove();

  std::filesystem::path sockets_;
  std::unique_ptr<FileLock> windows_;  // shared by all windows
};

// What programs that were killed have left of a folder or file that they were making.
void remove_partials(const std::filesystem::path& path);

// The socket of this program's window for a client; `use` is "pointer" or "sound".
[[nodiscard]] std::filesystem::path socket_path(const std::filesystem::path& sockets, const char* use);

}  // namespace osteon
