// The open connections of a server: where each comes from, whose it is, and its descriptor, by which it can be closed.
// gRPC owns the descriptors. It neither counts connections nor closes one on request.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/core/mutex.hpp"

namespace osteon {

struct Connection {
  std::string peer;        // as gRPC writes it: "ipv4:10.0.0.7:50123", "ipv6:%5B::1%5D:50123"
  std::string user;        // from the certificate; empty until a call has come over the connection
  std::string serial;      // likewise, hexadecimal
  bool is_proxys = false;  // from the Unix socket of a proxy: carries calls of many people, and is never closed here
  std::chrono::steady_clock::time_point accepted{};
};

// Any thread may call it.
class Connections {
 public:
  // Adds an accepted connection. Returns false, and does not add it, if the system cannot say where it comes from.
  [[nodiscard]] bool add(int descriptor);
  // Number of open connections. Removes closed ones from the table.
  std::size_t count();
  [[nodiscard]] bool has_room(std::size_t most);  // fewer than `most` are open
  // A call came over the connection of `peer` with this certificate.
  void identify(const std::string& peer, const std::string& user, const std::string& serial);
  // Addresses of open connections over which no call has come, without ports and without duplicates. A failed handshake
  // belongs to one of them. At most `most`.
  [[nodiscard]] std::vector<std::string> unidentified(std::size_t most);
  // Cuts off each connection for which `which` returns true, and discards data that arrived unread. gRPC then sees the
  // end of the connection and drops it with all its calls. Returns how many were cut off.
  std::size_t close_if(const std::function<bool(const Connection&)>& which);
  [[nodiscard]] bool is_open(const std::string& peer);  // false also once close_if() has cut it off

 private:
  struct Entry {
    int descriptor = -1;
    std::uint64_t inode = 0;  // distinguishes a closed connection from another one with the same descriptor
    Connection connection;
    bool is_cut_off = false;
  };
  void drop_closed() OSTEON_REQUIRES(mutex_);

  Mutex mutex_{LockRank::leaf};
  std::map<std::string, Entry> open_ OSTEON_GUARDED_BY(mutex_);  // by peer
};

// The addresses of unidentified() as one text for a log line; "" if there are none.
[[nodiscard]] std::string some_addresses(Connections& connections);
// Gives "ipv4:10.0.0.7" for "ipv4:10.0.0.7:50123": unauthenticated clients may use many ports of one address.
[[nodiscard]] std::string address_of(std::string_view peer);

}  // namespace osteon
