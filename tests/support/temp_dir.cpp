#include "tests/support/temp_dir.hpp"

#include <stdlib.h>
#include <string>

#include "common/core/check.hpp"

namespace osteon::test {

TempDir::TempDir() {
  std::string pattern = (std::filesystem::temp_directory_path() / "osteon-test.XXXXXX").string();
  OSTEON_CHECK(::mkdtemp(pattern.data()) != nullptr);
  path_ = pattern;
}

TempDir::~TempDir() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace osteon::test
