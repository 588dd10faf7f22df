// osteon-impair as a child of a test.
#pragma once
#include <string>
#include <vector>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

class ImpairProcess {
 public:
  // `arguments`: all but --addresses, e.g. {"--udp", "127.0.0.1:4711", "--loss", "0.3"}. It is listening when this
  // returns.
  explicit ImpairProcess(std::vector<std::string> arguments);

  // HOST:PORT to reach the n-th server of that kind through it. Empty if it did not start.
  [[nodiscard]] std::string udp(std::size_t n = 0) const { return address("udp ", n); }
  [[nodiscard]] std::string tcp(std::size_t n = 0) const { return address("tcp ", n); }
  // Sends one command of relay.hpp and returns its answer; "no answer" if none came.
  std::string command(const std::string& line);
  [[nodiscard]] Process& process() { return process_; }

 private:
  [[nodiscard]] std::string address(const std::string& kind, std::size_t n) const;
  TempDir folder_;
  Process process_;
  std::vector<std::string> addresses_;
};

}  // namespace osteon::test
