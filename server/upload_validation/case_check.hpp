// Takes a stranger's archive apart and looks its case through, in a process of its own, so that a file made to break
// its reader breaks nothing else. The process writes the case anew from what it has read: what was sent is never read
// by anybody else.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "server/upload_validation/case_archive.hpp"

namespace osteon {

struct CheckedCase {
  Digest hash;
  std::string title;
  std::uint64_t memory_bytes = 0;  // that it takes once it is loaded
};

// Where the case is in the folder that check_case() was given, once it is done.
inline constexpr std::string_view kSoundCase = "sound";

// Any thread. Starts `program` as "PROGRAM check-case ARCHIVE FOLDER QUOTA" and waits for what it says. The process
// unpacks the archive, which lies in the folder, and writes the case into it anew; no name in it is that of anything
// but a case's plain files. Errors: what is wrong with the archive or the case in its words; invalid_input (it died, as
// over a damaged file), exhausted (memory, time or disk beyond the quota), internal (disk; cannot be started),
// cancelled (`stop` returned true).
[[nodiscard]] Result<CheckedCase> check_case(const std::filesystem::path& program, const std::filesystem::path& archive,
                                             const std::filesystem::path& folder, const UploadQuota& quota,
                                             const std::function<bool()>& stop = {});

// [main of that program, before other threads] Gives up what it does not need, does that, prints one line for the
// process that waits, and returns the exit code. `quota`: as check_case() writes it.
[[nodiscard]] int run_case_check(const std::filesystem::path& archive, const std::filesystem::path& folder,
                                 const std::string& quota);

}  // namespace osteon
