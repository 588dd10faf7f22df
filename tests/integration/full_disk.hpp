// A full disk for the programs that a window starts. It is emulated; no real disk is full.
#pragma once
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "tests/support/failing/failing_writes.hpp"

namespace osteon::test {

// Writes of children that start from now on fail where the path begins so, as on a full disk.
class FullDisk {
 public:
  FullDisk(const std::string& begin, const std::filesystem::path& control) : failing_(begin, control) {
    auto variables = failing_.options().environment;
    variables.emplace_back("OSTEON_FAILING_FOLDER", begin);
    for (const auto& [name, value] : variables) {
      const char* before = std::getenv(name.c_str());
      before_.emplace(name, before != nullptr ? std::optional<std::string>(before) : std::nullopt);
      ::setenv(name.c_str(), value.c_str(), 1);
    }
  }
  ~FullDisk() {
    make_room();
    for (const auto& [name, value] : before_)
      value ? ::setenv(name.c_str(), value->c_str(), 1) : ::unsetenv(name.c_str());
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  // Files can still be made and renamed, but nothing be written.
  void fill() const { failing_.begin(ENOSPC, "w"); }
  void make_room() const { failing_.end(); }

 private:
  FailingWrites failing_;
  std::map<std::string, std::optional<std::string>> before_;
};

}  // namespace osteon::test
