#include <fstream>
#include <utility>

#include "tests/support/failing/failing_writes.hpp"

namespace osteon::test {

FailingWrites::FailingWrites(std::filesystem::path folder, std::filesystem::path control)
    : folder_(std::move(folder)), control_(std::move(control)) {}

ProcessOptions FailingWrites::options() const {
  ProcessOptions options;
  const char* sanitizer = std::getenv("ASAN_OPTIONS");
  options.environment = {
      {"LD_PRELOAD", OSTEON_FAILING_LIBRARY},
      {"OSTEON_FAILING_FOLDER", folder_.string() + "/"},
      {"OSTEON_FAILING_CONTROL", control_.string()},
      // A sanitizer wants to be the first library. It works as well behind this one.
      {"ASAN_OPTIONS", std::string(sanitizer != nullptr ? sanitizer : "") + ":verify_asan_link_order=0"}};
  return options;
}

// The file gets its name only when it is whole, because it may be read at any moment.
void FailingWrites::begin(int reason, const std::string& kinds, int passed) const {
  const std::filesystem::path partial = control_.string() + ".partial";
  std::ofstream(partial) << reason << ' ' << kinds << ' ' << passed << '\n';
  std::filesystem::rename(partial, control_);
}

void FailingWrites::end() const { std::filesystem::remove(control_); }

}  // namespace osteon::test
