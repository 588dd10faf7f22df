// The proxy that belongs in front of a server (deploy/haproxy.cfg), started for a test on a port that the system
// chooses.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

// One of this machine alone that was free a moment ago, for programs that do not say which one the system gave them.
[[nodiscard]] int free_port();

class Proxy {
 public:
  // Words of the configuration, and what stands in their place.
  using Changes = std::vector<std::pair<std::string, std::string>>;
  // Why no proxy can be started here; empty: it can.
  [[nodiscard]] static std::string missing();
  // `certificates`: as deploy/certs server makes it. `socket`: that the server opens as its --proxy-socket. It hears of
  // revocations by deploy/proxy-revoked, as in deploy/serve.
  Proxy(const std::filesystem::path& certificates, const std::filesystem::path& socket, const Changes& changes = {});

  [[nodiscard]] const std::string& address() const { return address_; }  // HOST:PORT
  // Whether it has heard of so many revoked certificates; waits for it.
  [[nodiscard]] bool is_told_of(int revoked);
  [[nodiscard]] std::string log() const { return process_->out() + process_->err(); }
  [[nodiscard]] bool running() { return process_->running(); }

 private:
  TempDir dir_;
  std::string address_;
  std::optional<Process> process_, revoked_;
};

}  // namespace osteon::test
