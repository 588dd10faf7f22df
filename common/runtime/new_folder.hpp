// A new folder of files that is there as a whole or not at all.
#pragma once
#include <filesystem>
#include <functional>

#include "common/core/result.hpp"

namespace osteon {

// Calls `write` with an empty folder beside `folder`, and then gives it that name. If anything fails, removes
// what was written. Errors: exists, internal (disk), and those of `write`.
[[nodiscard]] Result<void> write_new_folder(const std::filesystem::path& folder,
                                            const std::function<Result<void>(const std::filesystem::path&)>& write);

}  // namespace osteon
