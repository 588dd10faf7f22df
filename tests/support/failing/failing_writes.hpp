// Processes whose disk fails: they run with a library before the system's own, which lets their writes fail when told.
// What comes of it is emulated; no disk has failed.
#pragma once
#include <filesystem>
#include <string>

#include "tests/support/process.hpp"

namespace osteon::test {

// Of all that processes started with options() write into one folder.
class FailingWrites {
 public:
  // `control`: a file outside of the folder.
  FailingWrites(std::filesystem::path folder, std::filesystem::path control);

  [[nodiscard]] ProcessOptions options() const;
  // From now on calls fail with this errno value: of `kinds`, w for writes, s for syncs, n for what makes or changes
  // names. So many of them still work.
  void begin(int reason, const std::string& kinds, int passed = 0) const;
  void end() const;

 private:
  std::filesystem::path folder_, control_;
};

}  // namespace osteon::test
