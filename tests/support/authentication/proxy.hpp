// The proxy in front of a server (deploy/haproxy.cfg), started for a test on a port that the system chooses.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

// A port of this machine that was free a moment ago. For programs that do not report the port that the system gave
// them.
[[nodiscard]] int free_port();

class Proxy {
 public:
  // Words of the configuration, and their replacements.
  using Changes = std::vector<std::pair<std::string, std::string>>;
  // The reason that no proxy can be started here. Empty: it can.
  [[nodiscard]] static std::string missing();
  // `certificates`: as deploy/certs server makes it. `socket`: the server opens it as its --proxy-socket. The proxy
  // gets revocations from deploy/proxy-revoked, as in deploy/serve.
  Proxy(const std::filesystem::path& certificates, const std::filesystem::path& socket, const Changes& changes = {});

  [[nodiscard]] const std::string& address() const { return address_; }  // HOST:PORT
  // Waits until the proxy has received this number of revoked certificates. False: it has not.
  [[nodiscard]] bool is_told_of(int revoked);
  [[nodiscard]] std::string log() const { return process_->out() + process_->err(); }
  [[nodiscard]] bool running() { return process_->running(); }

 private:
  TempDir dir_;
  std::string address_;
  std::optional<Process> process_, revoked_;
};

}  // namespace osteon::test
