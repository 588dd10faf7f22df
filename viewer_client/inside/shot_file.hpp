// The shots of a session on disk: fluoroscopy.jsonl beside its journal, one line of JSON for each shot. Lines are only
// appended.
#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "viewer_client/inside/c_arm_shot.hpp"

namespace osteon {

inline constexpr const char* kShotFileName = "fluoroscopy.jsonl";

// Not synchronised: one thread.
class ShotFile {
 public:
  // Of a session's folder. Nothing is read or made yet.
  explicit ShotFile(const std::filesystem::path& folder) : file_(folder / kShotFileName) {}

  // What read() found.
  struct Kept {
    std::vector<CArmShot> shots;
    // One sentence about lines that are no shots, as a crash leaves them, or about a file that cannot be read. Such
    // lines stay in the file and do not count.
    std::optional<std::string> fault;
  };
  [[nodiscard]] Kept read() const;

  // Appends the shot, after those that could not be written before. A line is written completely or not at all. Error:
  // internal, naming the file, the reason and the remedy, once until writing works again. In between it is quiet.
  [[nodiscard]] Result<void> add(const CArmShot& shot);
  // Writes those that could not be written before, if any. The same error, also if it was said.
  [[nodiscard]] Result<void> catch_up();
  [[nodiscard]] std::size_t waiting() const { return waiting_; }  // shots that are not in the file yet

 private:
  [[nodiscard]] Result<void> write();

  std::filesystem::path file_;
  std::string lines_;  // that are not in the file yet
  std::size_t waiting_ = 0;
  bool said_ = false;  // the last error
};

}  // namespace osteon
