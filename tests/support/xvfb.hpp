// A virtual screen for one test, on a display number that the system chooses.
#pragma once
#include <optional>
#include <string>

#include "tests/support/process.hpp"

namespace osteon::test {

class Xvfb {
 public:
  // Empty if Xvfb is not installed or does not start.
  [[nodiscard]] static std::optional<Xvfb> start(const std::string& size = "1280x720");

  [[nodiscard]] const std::string& display() const { return display_; }  // e.g. ":7"
  // Options for a Process that draws on this screen.
  [[nodiscard]] ProcessOptions options() const;

 private:
  Xvfb(Process process, std::string display) : process_(std::move(process)), display_(std::move(display)) {}
  Process process_;
  std::string display_;
};

}  // namespace osteon::test
