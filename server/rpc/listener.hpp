// Accepts connections and hands them on, up to a limit. gRPC 1.51 stops listening for good when the process has no
// descriptor left for a connection (CVE-2023-4785), and it counts no connections. So the server accepts connections
// itself.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/core/result.hpp"
#include "server/auth/connections.hpp"

namespace osteon {

struct ListenerCounts {
  std::size_t open = 0;                     // connections open now
  std::uint64_t accepted = 0, refused = 0;  // refused: beyond the limit, closed at once
  std::uint64_t failed = 0;                 // accept() failed, for example without free descriptors
};

class Listener {
 public:
  // `host`: a name or an address, [IPv6] in brackets. Listens at every address of it. `port` 0: the system chooses.
  // Errors: exists (the port is in use), unavailable (the system refuses for the reason in the message).
  [[nodiscard]] static Result<std::unique_ptr<Listener>> open(const std::string& host, int port, std::size_t most);
  // Listens at a Unix socket, which only this process's user and root can open. Replaces a socket that a process left
  // behind. `most` limits the connections of this socket alone. Errors: exists (a program listens there, or the file is
  // of another kind), unavailable.
  [[nodiscard]] static Result<std::unique_ptr<Listener>> open_at(const std::filesystem::path& socket, std::size_t most);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] int port() const { return port_; }
  // One address that it listens at, in numbers and without brackets. If the name has several, an IPv4 address: a client
  // that looks up the name for datagrams uses that one.
  [[nodiscard]] const std::string& address() const { return address_; }
  // For a server of plain text. `note` is called for each client that speaks TLS, on the listener's thread. Call it
  // before start().
  void watch_for_tls(std::function<void()> note);
  // From now on `take(listening, descriptor)` is called with every connection, on the listener's own thread. The callee
  // owns the descriptor.
  void start(std::function<void(int listening, int descriptor)> take);
  void stop();                            // accepts no more connections; call it once
  [[nodiscard]] ListenerCounts counts();  // any thread
  [[nodiscard]] Connections& connections() { return connections_; }

 private:
  explicit Listener(std::size_t most) : most_(most) {}
  void run();
  void accept_from(int listening);

  const std::size_t most_;
  std::vector<int> sockets_;
  int wake_ = -1;  // an eventfd that ends the thread
  int port_ = 0;
  std::string address_;
  std::filesystem::path path_;  // of a Unix socket; empty: none
  std::function<void(int, int)> take_;
  std::function<void()> note_tls_;  // empty: TLS is not watched for
  Connections connections_;         // those that were handed on
  std::atomic<std::uint64_t> accepted_ = 0, refused_ = 0, failed_ = 0;
  std::thread thread_;
};

}  // namespace osteon
