// Checks a contract between our own functions. Always on. A violation prints its position and aborts.
#pragma once

namespace osteon::core {
[[noreturn]] void check_failed(const char* expression, const char* file, int line) noexcept;
}

#define OSTEON_CHECK(expression) \
  ((expression) ? static_cast<void>(0) : ::osteon::core::check_failed(#expression, __FILE__, __LINE__))
