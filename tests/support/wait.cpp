#include "tests/support/wait.hpp"

#include <algorithm>
#include <fstream>
#include <thread>

namespace osteon::test {

namespace {
#ifdef OSTEON_SLOW_TESTS
constexpr int kSlower = 5;  // under a sanitizer, as the limits of ctest
#else
constexpr int kSlower = 1;
#endif
// Many conditions ask another program, or read a file. Asked every 2 ms, they took as long as the test.
constexpr std::chrono::milliseconds kShortest{2}, kLongest{20};
constexpr int kPauses = 50;  // a pause is this part of the time that has passed
}  // namespace

std::chrono::milliseconds stretched(std::chrono::milliseconds patience) { return kSlower * patience; }

bool wait_until(const std::function<bool()>& condition, std::chrono::milliseconds patience) {
  const auto began = std::chrono::steady_clock::now(), deadline = began + stretched(patience);
  while (!condition()) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= deadline) return false;
    std::this_thread::sleep_for(std::clamp<std::chrono::nanoseconds>((now - began) / kPauses, kShortest, kLongest));
  }
  return true;
}

bool wait_for_file(const std::filesystem::path& file, std::chrono::milliseconds patience) {
  return wait_until(
      [&] {
        std::error_code error;
        const auto size = std::filesystem::file_size(file, error);
        return !error && size > 0;
      },
      patience);
}

std::optional<std::string> wait_for_address(const std::filesystem::path& file, std::chrono::milliseconds patience) {
  std::string line;
  const auto read = [&] {
    std::ifstream in(file);
    return std::getline(in, line) && !in.eof();  // the line's end was written too
  };
  if (!wait_until(read, patience)) return std::nullopt;
  return line;
}

}  // namespace osteon::test
