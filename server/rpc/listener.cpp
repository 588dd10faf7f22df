#include "server/rpc/listener.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>

namespace osteon {
namespace {

constexpr int kWaiting = 128;  // connections that the system queues until they are accepted
constexpr int kPauseMs = 100;  // pause when there is no descriptor for a connection
constexpr int kAcceptedAtOnce = 64;

tl::unexpected<Error> refused_by_system(int reason) {
  if (reason == EADDRINUSE) return failure(ErrorCode::exists, "the port is in use by another program");
  return failure(ErrorCode::unavailable, std::generic_category().message(reason));
}

// Returns a descriptor that listens there, or the negative error number.
int listen_at(const addrinfo& address, int port) {
  sockaddr_storage at{};
  std::copy_n(reinterpret_cast<const char*>(address.ai_addr), address.ai_addrlen, reinterpret_cast<char*>(&at));
  (address.ai_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(at).sin6_port
                                 : reinterpret_cast<sockaddr_in&>(at).sin_port) =
      htons(static_cast<std::uint16_t>(port));
  const int socket = ::socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return -errno;
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (address.ai_family == AF_INET6) ::setsockopt(socket, IPPROTO_IPV6, IPV6_V6ONLY, &yes, sizeof yes);
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&at), address.ai_addrlen) == 0 &&
      ::listen(socket, kWaiting) == 0)
    return socket;
  const int reason = errno;
  ::close(socket);
  return -reason;
}

int port_of(int socket) {
  sockaddr_storage at{};
  socklen_t size = sizeof at;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size) != 0) return 0;
  return ntohs(at.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(at).sin6_port
                                        : reinterpret_cast<sockaddr_in&>(at).sin_port);
}

std::string numeric(const addrinfo& address) {
  char text[NI_MAXHOST] = "";
  (void)::getnameinfo(address.ai_addr, address.ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST);
  return text;
}

// Only programs of this process's user and of root may connect over a Unix socket, even if the socket's permissions
// were changed.
bool may_connect(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  int family = 0;
  socklen_t family_size = sizeof family;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_DOMAIN, &family, &family_size) != 0) return false;
  if (family != AF_UNIX) return true;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return false;
  return peer.uid == ::geteuid() || peer.uid == 0;
}

// Recognises TLS by the first byte sent: a handshake record (RFC 8446, section 5.1). No call over plain text begins
// with it.
bool speaks_tls(int descriptor) {
  constexpr char kHandshake = 22;
  char first = 0;
  return ::recv(descriptor, &first, 1, MSG_PEEK | MSG_DONTWAIT) == 1 && first == kHandshake;
}

}  // namespace

Result<std::unique_ptr<Listener>> Listener::open(const std::string& host, int port, std::size_t most) {
  const std::string name = host.starts_with('[') && host.ends_with(']') ? host.substr(1, host.size() - 2) : host;
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  if (const int unknown = ::getaddrinfo(name.c_str(), nullptr, &hints, &found); unknown != 0)
    return failure(ErrorCode::unavailable, ::gai_strerror(unknown));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, ::freeaddrinfo);
  std::unique_ptr<Listener> listener(new Listener(most));
  listener->port_ = port;
  int lacking = EADDRNOTAVAIL;
  bool has_ipv4 = false;
  for (const addrinfo* address = found; address; address = address->ai_next) {
    if (address->ai_family != AF_INET && address->ai_family != AF_INET6) continue;
    // All addresses use one port: that of the first, if the system chooses.
    const int socket = listen_at(*address, listener->port_);
    if (socket >= 0) {
      listener->sockets_.push_back(socket);
      listener->port_ = port_of(socket);
      if (listener->address_.empty() || (address->ai_family == AF_INET && !has_ipv4))
        listener->address_ = numeric(*address);
      has_ipv4 = has_ipv4 || address->ai_family == AF_INET;
    } else if (socket == -EADDRNOTAVAIL || socket == -EAFNOSUPPORT) {
      lacking = -socket;  // localhost has an address of each family, and a machine may lack one of them
    } else {
      return refused_by_system(-socket);
    }
  }
  if (listener->sockets_.empty()) return refused_by_system(lacking);
  listener->wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (listener->wake_ < 0) return refused_by_system(errno);
  return listener;
}

Result<std::unique_ptr<Listener>> Listener::open_at(const std::filesystem::path& path, std::size_t most) {
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof at.sun_path)
    return failure(ErrorCode::unavailable,
                   "a path of a Unix socket has at most " + std::to_string(sizeof at.sun_path - 1) + " bytes");
  std::ranges::copy(path.native(), at.sun_path);
  const auto* address = reinterpret_cast<const sockaddr*>(&at);
  std::unique_ptr<Listener> listener(new Listener(most));
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return refused_by_system(errno);
  listener->sockets_.push_back(socket);
  std::error_code unknown;
  if (std::filesystem::is_socket(path, unknown)) {
    // Nobody listens at the socket of a process that was killed.
    if (::connect(socket, address, sizeof at) == 0) return failure(ErrorCode::exists, "another program listens there");
    std::filesystem::remove(path, unknown);
  }
  // The socket is made with its final permissions, so others can never open it.
  const mode_t before = ::umask(0177);
  const int bound = ::bind(socket, address, sizeof at);
  const int reason = errno;
  ::umask(before);
  if (bound != 0) return refused_by_system(reason);
  listener->path_ = path;
  if (::listen(socket, kWaiting) != 0) return refused_by_system(errno);
  listener->wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (listener->wake_ < 0) return refused_by_system(errno);
  return listener;
}

Listener::~Listener() {
  stop();
  if (wake_ >= 0) ::close(wake_);
}

void Listener::watch_for_tls(std::function<void()> note) {
  note_tls_ = std::move(note);
  // Clients speak first, so the system hands a connection on when its first bytes have come, or after about a second.
  const int seconds = 1;
  for (const int socket : sockets_) ::setsockopt(socket, IPPROTO_TCP, TCP_DEFER_ACCEPT, &seconds, sizeof seconds);
}

void Listener::start(std::function<void(int, int)> take) {
  take_ = std::move(take);
  thread_ = std::thread([this] { run(); });
}

void Listener::stop() {
  if (thread_.joinable()) {
    const std::uint64_t one = 1;
    (void)!::write(wake_, &one, sizeof one);
    thread_.join();
  }
  for (const int socket : sockets_) ::close(socket);
  sockets_.clear();
  if (!path_.empty()) ::unlink(path_.c_str());
}

void Listener::run() {
  std::vector<pollfd> all;
  for (const int socket : sockets_) all.push_back({socket, POLLIN, 0});
  all.push_back({wake_, POLLIN, 0});
  while (true) {
    if (::poll(all.data(), all.size(), -1) < 0 && errno != EINTR) return;
    if (all.back().revents != 0) return;
    for (std::size_t i = 0; i + 1 < all.size(); ++i)
      if (all[i].revents != 0) accept_from(all[i].fd);
  }
}

void Listener::accept_from(int listening) {
  for (int i = 0; i < kAcceptedAtOnce; ++i) {
    const int descriptor = ::accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK) return;
      if (errno == EINTR || errno == ECONNABORTED) continue;
      // Without descriptors or memory, the client waits in the system's queue until there are some again.
      ++failed_;
      pollfd end{wake_, POLLIN, 0};
      (void)::poll(&end, 1, kPauseMs);
      return;
    }
    if (!may_connect(descriptor) || !connections_.has_room(most_) || !connections_.add(descriptor)) {
      ++refused_;
      ::close(descriptor);
      continue;
    }
    const int yes = 1;
    ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    ++accepted_;
    if (note_tls_ && speaks_tls(descriptor)) note_tls_();
    take_(listening, descriptor);
  }
}

ListenerCounts Listener::counts() { return {connections_.count(), accepted_, refused_, failed_}; }

}  // namespace osteon
