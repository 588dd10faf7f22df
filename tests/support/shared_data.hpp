// Finds the checkout, and the data folder that may exist beside it.
#pragma once
#include <filesystem>
#include <optional>

namespace osteon::test {

[[nodiscard]] std::filesystem::path source_dir();

// The folder `shared` beside the checkout or beside a folder above it. Empty if there is none: a test that needs it
// then reports this and is skipped.
[[nodiscard]] std::optional<std::filesystem::path> find_shared();

// Cranium.inv3 of Debian's invesalius-examples. It is installed, or unpacked by deploy/install if the machine leaves
// out /usr/share/doc.
[[nodiscard]] std::optional<std::filesystem::path> find_skull();

}  // namespace osteon::test
