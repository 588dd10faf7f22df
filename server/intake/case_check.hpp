// Looks a stranger's case through in a process of its own, so that a file made to break its reader breaks nothing else. The
// process writes the case anew from what it has read: the files that were sent are never opened by anybody else.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "server/intake/case_archive.hpp"

namespace osteon {

struct CheckedCase {
  Digest hash;
  std::string title;
};

// Any thread. Starts `program` as "PROGRAM check-case FROM TO" and waits for what it says. Errors: what is wrong with the case
// in its words; invalid_input (it died, as over a damaged file), exhausted (memory, time or disk beyond the quota), internal
// (cannot be started), cancelled (`stop` returned true).
[[nodiscard]] Result<CheckedCase> check_case(const std::filesystem::path& program, const std::filesystem::path& from,
                                             const std::filesystem::path& to, const IntakeQuota& quota,
                                             const std::function<bool()>& stop = {});

// [main of that program] Gives up what it does not need, reads the case in `from`, writes it to `to`, prints one line for the
// process that waits, and returns the exit code.
[[nodiscard]] int run_case_check(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace osteon
