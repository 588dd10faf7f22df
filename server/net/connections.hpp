// The open connections of a server: from where each comes, whose it is, and its descriptor, by which it can be
// closed. gRPC owns the descriptors, and neither counts connections nor closes one on request.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace osteon {

struct Connection {
  std::string peer;        // as gRPC writes it: "ipv4:10.0.0.7:50123", "ipv6:%5B::1%5D:50123"
  std::string user;        // of the certificate; empty until a call came over it
  std::string serial;      // likewise, hexadecimal
  bool is_proxys = false;  // over the Unix socket of a proxy: of many people, and never closed here
  std::chrono::steady_clock::time_point accepted{};
};

// Any thread.
class Connections {
 public:
  // A connection that was accepted. False: the system cannot say whose it is; it is not kept.
  [[nodiscard]] bool add(int descriptor);
  // Those that are still open. Closed ones are dropped from the table here.
  std::size_t count();
  [[nodiscard]] bool has_room(std::size_t most);  // fewer than `most` are open
  // A call came over the connection of `peer` with this certificate.
  void identify(const std::string& peer, const std::string& user, const std::string& serial);
  // Addresses, without ports and each once, of open connections over which no call has come: a handshake that fails
  // is of one of them. At most `most`.
  [[nodiscard]] std::vector<std::string> unidentified(std::size_t most);
  // Cuts off each connection for which `which` is true, and drops what has arrived over it unread. gRPC then sees its
  // end and drops it with all its calls. Returns how many.
  std::size_t close_if(const std::function<bool(const Connection&)>& which);
  [[nodiscard]] bool is_open(const std::string& peer);  // false also once close_if() has cut it off

 private:
  struct Entry {
    int descriptor = -1;
    std::uint64_t inode = 0;  // tells a connection that was closed from another with its descriptor
    Connection connection;
    bool is_cut_off = false;
  };
  void drop_closed();  // under mutex_

  std::mutex mutex_;
  std::map<std::string, Entry> open_;  // by peer
};

// Those of unidentified(), as one text for a log line; "" where there is none.
[[nodiscard]] std::string some_addresses(Connections& connections);
// "ipv4:10.0.0.7" of "ipv4:10.0.0.7:50123": strangers come from one address by many ports.
[[nodiscard]] std::string address_of(std::string_view peer);

}  // namespace osteon
