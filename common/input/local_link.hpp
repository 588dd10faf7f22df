// A local socket between a window and a client that it starts, both of one user. Each message is one packet of text.
// The newest message counts, so neither end ever waits.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/core/result.hpp"

namespace osteon {

// A longer message is refused by its reader.
inline constexpr std::size_t kMostLinkBytes = 10240;

// What errors call the two: "the pointer's socket", "a haptic client".
struct LocalLinkNames {
  std::string socket, client;
};

using LinkMessageTaken = std::function<void(std::string_view text)>;

// A descriptor that closes itself.
class LocalSocket {
 public:
  LocalSocket() = default;
  explicit LocalSocket(int fd) : fd_(fd) {}
  LocalSocket(LocalSocket&& other) noexcept;
  LocalSocket& operator=(LocalSocket&& other) noexcept;
  ~LocalSocket() { close(); }
  void close();
  [[nodiscard]] int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// The window's end. For one thread; no call waits.
class LocalServer {
 public:
  // Makes the socket, which only this user may open. A socket that a dead program left is replaced. Errors: exists (a
  // program listens there), invalid_input (the path is too long), internal.
  [[nodiscard]] static Result<std::unique_ptr<LocalServer>> listen(const std::filesystem::path& socket,
                                                                   const LocalLinkNames& names);
  ~LocalServer();  // removes the socket

  // Accepts a waiting client if none is connected, and receives its messages: `take` gets each one.
  void attend(const LinkMessageTaken& take);
  void send(const std::string& text);
  [[nodiscard]] bool connected() const { return static_cast<bool>(peer_); }

 private:
  LocalServer(std::filesystem::path path, LocalSocket listening);
  std::filesystem::path path_;
  LocalSocket listening_, peer_;
};

// The client's end. For one thread.
class LocalClient {
 public:
  // Errors: not_found (nobody listens there), denied (a program of another user does), unavailable (other clients wait
  // there), invalid_input (the path is too long).
  [[nodiscard]] static Result<std::unique_ptr<LocalClient>> connect(const std::filesystem::path& socket,
                                                                    const LocalLinkNames& names);
  // Waits at most so long for a message. `take` gets each one that has come.
  void wait(int milliseconds, const LinkMessageTaken& take);
  void send(const std::string& text);
  [[nodiscard]] bool closed() const { return !peer_; }  // the window has gone

 private:
  explicit LocalClient(LocalSocket peer) : peer_(std::move(peer)) {}
  LocalSocket peer_;
};

// The window's end, with messages: it sends `Outgoing`, as encode() writes it, and receives `Incoming`. For one thread;
// no call waits.
template <class Outgoing, class Incoming, Result<Incoming> (*kRead)(std::string_view), LocalLinkNames (*kNames)()>
class LocalMessageServer {
 public:
  // Errors: those of LocalServer::listen().
  [[nodiscard]] static Result<std::unique_ptr<LocalMessageServer>> listen(const std::filesystem::path& socket) {
    auto link = LocalServer::listen(socket, kNames());
    if (!link) return tl::unexpected(link.error());
    return std::unique_ptr<LocalMessageServer>(new LocalMessageServer(std::move(*link)));
  }

  void send(const Outgoing& message) {
    attend();
    link_->send(encode(message));
  }
  // The client's newest message. None: none has come yet, or no client is connected.
  [[nodiscard]] const std::optional<Incoming>& newest() {
    attend();
    return newest_;
  }
  [[nodiscard]] bool connected() {
    attend();
    return link_->connected();
  }
  // Time since the newest message came. None: as of newest().
  [[nodiscard]] std::optional<std::chrono::duration<double, std::milli>> silence() const {
    if (!newest_) return std::nullopt;
    return std::chrono::steady_clock::now() - received_at_;
  }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }  // messages that could not be read

 private:
  explicit LocalMessageServer(std::unique_ptr<LocalServer> link) : link_(std::move(link)) {}
  void attend() {
    link_->attend([this](std::string_view text) {
      Result<Incoming> message = kRead(text);
      if (message)
        newest_ = std::move(*message);
      else
        ++refused_;
      received_at_ = std::chrono::steady_clock::now();
    });
    if (!link_->connected()) newest_.reset();
  }

  std::unique_ptr<LocalServer> link_;
  std::optional<Incoming> newest_;
  std::chrono::steady_clock::time_point received_at_;
  std::uint64_t refused_ = 0;
};

// The client's end, with messages. For one thread.
template <class Outgoing, class Incoming, Result<Incoming> (*kRead)(std::string_view), LocalLinkNames (*kNames)()>
class LocalMessageClient {
 public:
  // Errors: those of LocalClient::connect().
  [[nodiscard]] static Result<std::unique_ptr<LocalMessageClient>> connect(const std::filesystem::path& socket) {
    auto link = LocalClient::connect(socket, kNames());
    if (!link) return tl::unexpected(link.error());
    return std::unique_ptr<LocalMessageClient>(new LocalMessageClient(std::move(*link)));
  }

  // Waits at most so long. Returns the newest message. None: none came.
  [[nodiscard]] std::optional<Incoming> wait(int milliseconds) {
    std::optional<Incoming> newest;
    link_->wait(milliseconds, [&](std::string_view text) {
      Result<Incoming> message = kRead(text);
      if (message)
        newest = std::move(*message);
      else
        ++refused_;
    });
    return newest;
  }
  void send(const Outgoing& message) { link_->send(encode(message)); }
  [[nodiscard]] bool closed() const { return link_->closed(); }     // the window has gone
  [[nodiscard]] std::uint64_t refused() const { return refused_; }  // messages that could not be read

 private:
  explicit LocalMessageClient(std::unique_ptr<LocalClient> link) : link_(std::move(link)) {}
  std::unique_ptr<LocalClient> link_;
  std::uint64_t refused_ = 0;
};

}  // namespace osteon
