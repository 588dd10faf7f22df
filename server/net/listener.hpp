// Accepts connections and hands them on, as many as are allowed at a time. gRPC 1.51 stops listening for good when the
// process has no descriptor left for a connection (CVE-2023-4785), and counts none: so the server accepts for itself.
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
#include "server/net/connections.hpp"

namespace osteon {

struct ListenerCounts {
  std::size_t open = 0;                     // connections now
  std::uint64_t accepted = 0, refused = 0;  // beyond the limit: closed at once
  std::uint64_t failed = 0;                 // accept() could not, as without descriptors
};

class Listener {
 public:
  // `host`: a name or an address, [IPv6] in brackets; every address of it is listened on. `port` 0: the system chooses.
  // Errors: exists (the port is in use), unavailable (the system refuses for the reason in the message).
  [[nodiscard]] static Result<std::unique_ptr<Listener>> open(const std::string& host, int port, std::size_t most);
  // At a Unix socket, which only this process's user and root can open. One that a process left behind is replaced;
  // `most` counts its connections alone. Errors: exists (a program listens there, or it is a file of another kind),
  // unavailable.
  [[nodiscard]] static Result<std::unique_ptr<Listener>> open_at(const std::filesystem::path& socket, std::size_t most);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] int port() const { return port_; }
  // One that it listens on, in numbers and without brackets. Of a name that has several, of IPv4: whoever looks up the
  // name for datagrams takes that.
  [[nodiscard]] const std::string& address() const { return address_; }
  // For a server of plain text: `note` hears of each client that speaks TLS, on the listener's thread. Before start().
  void watch_for_tls(std::function<void()> note);
  // From now on `take(listening, descriptor)` is called with every connection, which it owns; on a thread of the
  // listener's own.
  void start(std::function<void(int listening, int descriptor)> take);
  void stop();                            // accepts no more; once
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
  std::filesystem::path path_;  // of a Unix socket; empty: there is none
  std::function<void(int, int)> take_;
  std::function<void()> note_tls_;  // empty: nobody asks
  Connections connections_;         // that were handed on
  std::atomic<std::uint64_t> accepted_ = 0, refused_ = 0, failed_ = 0;
  std::thread thread_;
};

}  // namespace osteon
