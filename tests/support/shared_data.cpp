#include "tests/support/shared_data.hpp"

namespace osteon::test {
namespace {
constexpr const char* kSkull = "usr/share/doc/invesalius-examples/examples/Cranium.inv3";
}

std::filesystem::path source_dir() { return OSTEON_SOURCE_DIR; }

std::optional<std::filesystem::path> find_shared() {
  const std::filesystem::path root = source_dir().root_path();
  for (auto folder = source_dir(); folder != root; folder = folder.parent_path()) {
    const auto candidate = folder.parent_path() / "shared";
    if (std::filesystem::is_directory(candidate / "data")) return candidate;
  }
  return std::nullopt;
}

std::optional<std::filesystem::path> find_skull() {
  for (const auto& root : {std::filesystem::path("/"), source_dir() / "build/examples"}) {
    if (std::filesystem::exists(root / kSkull)) return root / kSkull;
  }
  return std::nullopt;
}

}  // namespace osteon::test
