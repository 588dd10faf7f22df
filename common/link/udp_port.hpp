// A real UDP socket as a DatagramPort.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/core/result.hpp"
#include "common/link/datagram.hpp"

namespace osteon {

struct UdpPortOptions {
  std::string address =
      "127.0.0.1";         // a numeric address of this machine; "0.0.0.0" or "::" for all; "::" also receives IPv4
  std::uint16_t port = 0;  // 0: the system chooses
  int receive_buffer_bytes = 1 << 21;  // holds what arrives between two turns of the loop; the system may grant less
};

// Datagrams since the port was opened.
struct UdpPortCounts {
  std::uint64_t sent = 0, send_failed = 0;  // send_failed: the system had no room for it, or has no route
  std::uint64_t received = 0, dropped = 0;  // dropped: longer than kMostDatagramBytes
  std::uint64_t receive_failed = 0;  // the system reported another error, such as that no program listens at the peer
};

// The destructor closes the socket. Network errors (a peer that refuses, no route) are counted and never close it.
class UdpPort final : public DatagramPort {
 public:
  // Errors: invalid_input (the address), unavailable (the port is taken, the address is not this machine's).
  [[nodiscard]] static Result<std::unique_ptr<UdpPort>> open(const UdpPortOptions& options);
  ~UdpPort() override;

  void send(const Endpoint& to, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::optional<Datagram> receive(std::span<std::uint8_t> into) override;
  [[nodiscard]] Endpoint local() const override;
  // Waits until there may be something to receive, wake() was called, or `patience` has passed: then false. Called by
  // the thread that receives.
  bool wait(std::chrono::nanoseconds patience);
  // Ends a wait, or the next one if none is under way. Any thread.
  void wake();
  // Any thread.
  [[nodiscard]] UdpPortCounts counts() const;

 private:
  struct Socket;
  explicit UdpPort(std::unique_ptr<Socket> socket);

  std::unique_ptr<Socket> socket_;
  std::atomic<std::uint64_t> sent_{0}, send_failed_{0}, received_{0}, dropped_{0}, receive_failed_{0};
};

// The endpoint of a server's name or numeric address. It asks the system's resolver, which may take seconds, so do not
// call it on a thread that others wait for. Prefers IPv4 if there is a choice. Error: not_found, naming the host.
[[nodiscard]] Result<Endpoint> find_endpoint(const std::string& host, std::uint16_t port);

}  // namespace osteon
