#include "common/core/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace osteon::core {

void check_failed(const char* expression, const char* file, int line) noexcept {
  std::fprintf(stderr, "%s:%d: broken promise: %s\n", file, line, expression);
  std::abort();
}

}  // namespace osteon::core
