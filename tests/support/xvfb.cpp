#include "tests/support/xvfb.hpp"

namespace osteon::test {

std::optional<Xvfb> Xvfb::start(const std::string& size) {
  Process process("Xvfb", {"-displayfd", "1", "-screen", "0", size + "x24", "-nolisten", "tcp", "-noreset"});
  const auto number = process.read_line(std::chrono::seconds{20});
  if (!number || number->empty()) return std::nullopt;
  return Xvfb(std::move(process), ":" + *number);
}

ProcessOptions Xvfb::options() const {
  ProcessOptions options;
  options.environment = {{"DISPLAY", display_}, {"LIBGL_ALWAYS_SOFTWARE", "1"}};
  options.without = {"WAYLAND_DISPLAY", "XAUTHORITY"};
  return options;
}

}  // namespace osteon::test
