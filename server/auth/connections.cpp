#include "server/auth/connections.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

namespace osteon {
namespace {

std::optional<std::uint64_t> inode_of(int descriptor) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0) return {};
  return about.st_ino;
}

constexpr std::string_view kUnix = "unix:";

// The peer of a connection as gRPC writes it; empty: none. All connections of a Unix socket have one address; `inode`
// distinguishes them.
std::string peer_of(int descriptor, std::uint64_t inode) {
  sockaddr_storage at{};
  socklen_t size = sizeof at;
  char text[INET6_ADDRSTRLEN] = "";
  if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&at), &size) != 0) return {};
  if (at.ss_family == AF_UNIX) return std::string(kUnix) + std::to_string(inode);
  if (at.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(at);
    if (!::inet_ntop(AF_INET, &v4.sin_addr, text, sizeof text)) return {};
    return "ipv4:" + std::string(text) + ":" + std::to_string(ntohs(v4.sin_port));
  }
  if (at.ss_family != AF_INET6) return {};
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(at);
  if (!::inet_ntop(AF_INET6, &v6.sin6_addr, text, sizeof text)) return {};
  const std::string zone = v6.sin6_scope_id == 0 ? "" : "%25" + std::to_string(v6.sin6_scope_id);
  return "ipv6:%5B" + std::string(text) + zone + "%5D:" + std::to_string(ntohs(v6.sin6_port));
}

}  // namespace

bool Connections::add(int descriptor) {
  const std::optional<std::uint64_t> inode = inode_of(descriptor);
  const std::string peer = inode ? peer_of(descriptor, *inode) : "";
  if (peer.empty()) return false;
  const MutexLock lock(mutex_);
  open_[peer] = {descriptor,
                 *inode,
                 {.peer = peer,
                  .user = {},
                  .serial = {},
                  .is_proxys = peer.starts_with(kUnix),
                  .accepted = std::chrono::steady_clock::now()}};
  return true;
}

void Connections::drop_closed() {
  std::erase_if(open_, [](const auto& entry) { return inode_of(entry.second.descriptor) != entry.second.inode; });
}

std::size_t Connections::count() {
  const MutexLock lock(mutex_);
  drop_closed();
  return open_.size();
}

bool Connections::has_room(std::size_t most) {
  const MutexLock lock(mutex_);
  // Looks which connections are still open only if it matters.
  if (open_.size() >= most) drop_closed();
  return open_.size() < most;
}

void Connections::identify(const std::string& peer, const std::string& user, const std::string& serial) {
  const MutexLock lock(mutex_);
  const auto known = open_.find(peer);
  if (known == open_.end() || known->second.connection.serial == serial) return;
  known->second.connection.user = user;
  known->second.connection.serial = serial;
}

std::vector<std::string> Connections::unidentified(std::size_t most) {
  const MutexLock lock(mutex_);
  drop_closed();
  std::vector<std::string> addresses;
  for (const auto& [peer, entry] : open_) {
    if (addresses.size() == most) break;
    if (!entry.connection.serial.empty() || entry.connection.is_proxys) continue;
    std::string address = address_of(peer);
    if (std::ranges::find(addresses, address) == addresses.end()) addresses.push_back(std::move(address));
  }
  return addresses;
}

std::size_t Connections::close_if(const std::function<bool(const Connection&)>& which) {
  const MutexLock lock(mutex_);
  drop_closed();
  std::size_t closed = 0;
  for (auto& [peer, entry] : open_) {
    if (entry.connection.is_proxys || entry.is_cut_off || !which(entry.connection)) continue;
    // gRPC may close it at this moment, and another connection may take its descriptor. That one is then cut off, and
    // connects again.
    // After shutdown(), the receive queue would still be read: thousands of calls (CVE-2023-44487). So the
    // socket is disconnected instead.
    const sockaddr nowhere{.sa_family = AF_UNSPEC, .sa_data = {}};
    (void)::connect(entry.descriptor, &nowhere, sizeof nowhere);  // fails where gRPC has just closed it
    entry.is_cut_off = true;
    ++closed;
  }
  return closed;
}

bool Connections::is_open(const std::string& peer) {
  const MutexLock lock(mutex_);
  const auto known = open_.find(peer);
  return known != open_.end() && !known->second.is_cut_off;
}

std::string some_addresses(Connections& connections) {
  constexpr std::size_t kMostNamed = 8;
  std::string all;
  for (const std::string& address : connections.unidentified(kMostNamed)) all += (all.empty() ? "" : " or ") + address;
  return all;
}

std::string address_of(std::string_view peer) {
  const std::size_t port = peer.rfind(':');
  return std::string(port == std::string_view::npos || port <= peer.find(':') ? peer : peer.substr(0, port));
}

}  // namespace osteon
