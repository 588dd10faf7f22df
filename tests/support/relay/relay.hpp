// Stands between real programs and impairs their traffic like a bad network. The core of osteon-impair.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "tests/support/network/impairment.hpp"

namespace osteon::test {

struct RelayOptions {
  std::vector<std::string> udp,
      tcp;              // HOST:PORT of each server, the host a numeric address; one listening port for each
  PathQuality quality;  // of both directions
  std::uint64_t seed = 1;
};

// UDP: each client has its own socket towards the server, as behind a router, so that answers find the way back. TCP
// stays in order and loses nothing: a lost segment comes 200 ms later, as after a retransmission, and all behind it
// too. During a partition UDP data is lost, and TCP data waits for its end.
class Relay {
 public:
  // Listens on ports of 127.0.0.1 that the system chooses. Errors: invalid_input (a target), unavailable (no socket).
  [[nodiscard]] static Result<std::unique_ptr<Relay>> open(const RelayOptions& options);
  ~Relay();

  // "udp 127.0.0.1:PORT" or "tcp 127.0.0.1:PORT", in the order of the options, UDP first.
  [[nodiscard]] std::vector<std::string> addresses() const;
  // Runs until a command or a signal ends it: SIGTERM and SIGINT do. SIGUSR1 is a partition of 3 s. Commands are lines
  // of standard input. Each is answered by a line on standard output: "ok" or the fault:
  //   partition MS | reset | rebind | loss P | reorder P | duplicate P | delay MS [JITTER_MS] | kbit N | good | counts
  //   | quit
  // reset breaks all TCP connections. rebind gives the UDP clients new ports towards the server. good ends all
  // impairment. counts answers "ok udp GIVEN LOST TWICE HELD_BACK tcp CONNECTIONS RESET".
  void run();
  // Runs one command, as above.
  std::string command(const std::string& line);

 private:
  struct Impl;
  explicit Relay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::test
