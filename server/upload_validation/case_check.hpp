// Unpacks and checks an archive of untrusted origin, in a process of its own. So a file made to break its reader breaks
// nothing else. The process writes the case again from what it has read. No other process ever reads what was sent.
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
  std::uint64_t memory_bytes = 0;  // memory that the case takes when it is loaded
};

// Where the case is in the folder given to check_case(), once it is done.
inline constexpr std::string_view kSoundCase = "sound";

// Any thread. Starts `program` as "PROGRAM check-case ARCHIVE FOLDER QUOTA" and waits for its answer. The process
// unpacks the archive, which lies in the folder, and writes the case again into the folder. It uses no file names but
// those of a case's plain files. Errors: what is wrong with the archive or the case, in the words of the process;
// invalid_input (it died, for example over a damaged file), exhausted (memory, time or disk beyond the quota), internal
// (disk; cannot be started), cancelled (`stop` returned true).
[[nodiscard]] Result<CheckedCase> check_case(const std::filesystem::path& program, const std::filesystem::path& archive,
                                             const std::filesystem::path& folder, const UploadQuota& quota,
                                             const std::function<bool()>& stop = {});

// [main of that program, before other threads] Gives up the rights that it does not need and checks the case. Then it
// prints one line for the waiting process, and ends this one. `quota`: as check_case() writes it.
[[noreturn]] void run_case_check(const std::filesystem::path& archive, const std::filesystem::path& folder,
                                 const std::string& quota);

}  // namespace osteon
