// Where tests find the checkout and the data folder that may lie beside it.
#pragma once
#include <filesystem>
#include <optional>

namespace osteon::test {

[[nodiscard]] std::filesystem::path source_dir();

// The folder `shared` beside the checkout or beside a folder above it; empty where there is none, and then a test
// that needs it says so and is skipped.
[[nodiscard]] std::optional<std::filesystem::path> find_shared();

// Cranium.inv3 of Debian's invesalius-examples: installed, or unpacked by deploy/install where the machine leaves out
// /usr/share/doc.
[[nodiscard]] std::optional<std::filesystem::path> find_skull();

}  // namespace osteon::test
