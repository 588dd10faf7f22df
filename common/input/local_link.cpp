#include "common/input/local_link.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace osteon {

LocalSocket::LocalSocket(LocalSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

LocalSocket& LocalSocket::operator=(LocalSocket&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

void LocalSocket::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

namespace {

Result<sockaddr_un> address_of(const std::filesystem::path& socket, const LocalLinkNames& names) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& path = socket.native();
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return failure(ErrorCode::invalid_input, names.socket + " " + path + ": its path must have from 1 to " +
                                                 std::to_string(sizeof address.sun_path - 1) + " characters");
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

Error trouble(const std::filesystem::path& socket, const LocalLinkNames& names) {
  return {ErrorCode::internal, names.socket + " " + socket.string() + " cannot be made: " + std::strerror(errno)};
}

bool same_user(int fd) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == ::geteuid();
}

void send_text(LocalSocket& to, const std::string& text) {
  if (!to) return;
  // A full buffer drops the message: a newer one follows. Anything else is the end of the connection.
  if (::send(to.get(), text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno != EAGAIN &&
      errno != EWOULDBLOCK && errno != EINTR && errno != ENOBUFS)
    to.close();
}

void receive_all(LocalSocket& from, const LinkMessageTaken& take) {
  // One byte more, so that the part of a longer message is not taken for a whole one.
  std::array<char, kMostLinkBytes + 1> buffer;
  while (from) {
    const ssize_t size = ::recv(from.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size > 0) {
      take(std::string_view(buffer.data(), static_cast<std::size_t>(size)));
    } else if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return;
    } else if (!(size < 0 && errno == EINTR)) {
      from.close();
    }
  }
}

}  // namespace

LocalServer::LocalServer(std::filesystem::path path, LocalSocket listening)
    : path_(std::move(path)), listening_(std::move(listening)) {}

LocalServer::~LocalServer() { ::unlink(path_.c_str()); }

Result<std::unique_ptr<LocalServer>> LocalServer::listen(const std::filesystem::path& socket,
                                                         const LocalLinkNames& names) {
  const Result<sockaddr_un> address = address_of(socket, names);
  if (!address) return tl::unexpected(address.error());
  const auto other = LocalClient::connect(socket, names);
  if (other || other.error().code == ErrorCode::unavailable || other.error().code == ErrorCode::denied)
    return failure(ErrorCode::exists, "a program listens at " + names.socket + " " + socket.string() +
                                          " already; end it, or choose another path");
  LocalSocket listening(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listening) return tl::unexpected(trouble(socket, names));
  std::error_code ignored;
  if (std::filesystem::is_socket(socket, ignored)) ::unlink(socket.c_str());
  // Nobody else may open it, from the moment it exists.
  const mode_t before = ::umask(0177);
  const int bound = ::bind(listening.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof(sockaddr_un));
  ::umask(before);
  if (bound != 0 || ::listen(listening.get(), 1) != 0) return tl::unexpected(trouble(socket, names));
  return std::unique_ptr<LocalServer>(new LocalServer(socket, std::move(listening)));
}

void LocalServer::attend(const LinkMessageTaken& take) {
  while (!peer_) {
    LocalSocket waiting(::accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!waiting) break;
    if (same_user(waiting.get())) peer_ = std::move(waiting);
  }
  receive_all(peer_, take);
}

void LocalServer::send(const std::string& text) { send_text(peer_, text); }

Result<std::unique_ptr<LocalClient>> LocalClient::connect(const std::filesystem::path& socket,
                                                          const LocalLinkNames& names) {
  const Result<sockaddr_un> address = address_of(socket, names);
  if (!address) return tl::unexpected(address.error());
  LocalSocket peer(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!peer) return tl::unexpected(trouble(socket, names));
  if (::connect(peer.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof(sockaddr_un)) != 0) {
    // Others wait for this window already. So it lives, even if it is busy.
    if (errno == EAGAIN)
      return failure(ErrorCode::unavailable, "the window at " + names.socket + " " + socket.string() + " has " +
                                                 names.client + " already; end that one first");
    return failure(ErrorCode::not_found, "no window listens at " + names.socket + " " + socket.string() +
                                             "; start osteon, which starts this program by itself");
  }
  if (!same_user(peer.get()))
    return failure(ErrorCode::denied,
                   names.socket + " " + socket.string() + " belongs to another user; name one of your own");
  return std::unique_ptr<LocalClient>(new LocalClient(std::move(peer)));
}

void LocalClient::wait(int milliseconds, const LinkMessageTaken& take) {
  if (!peer_) return;
  pollfd ready{peer_.get(), POLLIN, 0};
  if (::poll(&ready, 1, milliseconds) <= 0) return;
  receive_all(peer_, take);
}

void LocalClient::send(const std::string& text) { send_text(peer_, text); }

}  // namespace osteon
