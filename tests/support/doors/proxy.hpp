// The proxy that belongs in front of a server (deploy/haproxy.cfg), started for a test on a port that the system chooses.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

class Proxy {
 public:
  // Why no proxy can be started here; empty: it can.
  [[nodiscard]] static std::string missing();
  // `certificates`: as deploy/certs server makes it. `socket`: that the server opens as its --proxy-socket.
  Proxy(const std::filesystem::path& certificates, const std::filesystem::path& socket);

  [[nodiscard]] const std::string& address() const { return address_; }  // HOST:PORT
  // deploy/proxy-revoked, as whoever revokes somebody runs it.
  void tell_who_was_revoked();
  [[nodiscard]] std::string log() const { return process_->out() + process_->err(); }
  [[nodiscard]] bool running() { return process_->running(); }

 private:
  TempDir dir_;
  const std::filesystem::path certificates_;
  std::string address_;
  std::optional<Process> process_;
};

}  // namespace osteon::test
