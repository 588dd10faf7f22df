// A case as one file, NAME.osteon: a zip archive of the files of its folder. A person can open it by a double click,
// and send it to others. Whoever opens it need not trust the sender: it is checked as an uploaded case is.
#pragma once
#include <filesystem>
#include <string_view>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "server/upload_validation/case_archive.hpp"
#include "server/upload_validation/case_check.hpp"

namespace osteon {

inline constexpr std::string_view kCaseFileEnding = ".osteon";

// Limits for a file of the user: 16 GiB packed or unpacked, all memory of the machine, half an hour.
[[nodiscard]] UploadQuota case_file_quota();

// Reads the case, so that nobody receives a damaged one, and packs it. Writes beside `file` and renames. `replace`:
// over a file that is there. Errors: those of Case::load(), load_scan() and pack_case(), and exists. After an error
// nothing new is left.
[[nodiscard]] Result<void> pack_case_file(const std::filesystem::path& folder, const std::filesystem::path& file,
                                          bool replace, const KeepGoing& keep_going);

// Unpacks and checks the file in a process of its own, see check_case(); `program` is what it starts. `folder` is there
// as a whole or not at all. Errors: exists, not_found (no such file), invalid_input (no plain file, or no sound case),
// exhausted (beyond the quota), internal (disk), cancelled. Each names the file.
[[nodiscard]] Result<CheckedCase> unpack_case_file(const std::filesystem::path& program,
                                                   const std::filesystem::path& file,
                                                   const std::filesystem::path& folder, const UploadQuota& quota,
                                                   const KeepGoing& keep_going);

// Where a library of unpacked cases has a file: in a folder named by the SHA-256 of the file's bytes. So the same file
// is unpacked once, also after it was moved. Errors: as those of unpack_case_file().
[[nodiscard]] Result<std::filesystem::path> folder_of_case_file(const std::filesystem::path& library,
                                                                const std::filesystem::path& file,
                                                                const KeepGoing& keep_going);

}  // namespace osteon
