// Processes whose disk fails. They run with a library in front of the system's own, which makes their writes fail on
// request. The failure is emulated; no real disk has failed.
#pragma once
#include <filesystem>
#include <string>

#include "tests/support/process.hpp"

namespace osteon::test {

// For all processes started with options(): their writes into one folder.
class FailingWrites {
 public:
  // `control`: a file outside the folder.
  FailingWrites(std::filesystem::path folder, std::filesystem::path control);

  [[nodiscard]] ProcessOptions options() const;
  // From now on calls fail with this errno value. `kinds`: w for writes, s for syncs, n for calls that make or change
  // names. The first `passed` calls still work.
  void begin(int reason, const std::string& kinds, int passed = 0) const;
  void end() const;

 private:
  std::filesystem::path folder_, control_;
};

}  // namespace osteon::test
