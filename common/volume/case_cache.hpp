// The cases that clients keep on this machine: one folder for each, named by the hash of the case.
#pragma once
#include <filesystem>
#include <functional>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/volume/case.hpp"

namespace osteon {

// XDG_CACHE_HOME/osteon/cases, or ~/.cache/osteon/cases.
[[nodiscard]] std::filesystem::path default_case_cache();

// The case with this hash. If the cache does not have it undamaged, `fetch` writes its files to a folder, which is then
// kept. Any thread and process at the same time. Errors: those of `fetch`; those of Case::load; invalid_input (the
// files are of another case); internal (the cache cannot be written).
[[nodiscard]] Result<Case> cached_case(const std::filesystem::path& cache, const Digest& hash,
                                       const std::function<Result<void>(const std::filesystem::path& folder)>& fetch);

}  // namespace osteon
