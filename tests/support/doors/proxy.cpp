#include "tests/support/doors/proxy.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <vector>

#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kPrograms[] = {"/usr/sbin/haproxy", "/usr/bin/haproxy"};

std::filesystem::path haproxy() {
  for (const char* program : kPrograms)
    if (std::filesystem::exists(program)) return program;
  return {};
}

sockaddr_in loopback(int port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  return at;
}

// One that was free a moment ago: HAProxy does not say which one the system gave it.
int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in at = loopback(0);
  socklen_t size = sizeof at;
  (void)::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at);
  (void)::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size);
  ::close(socket);
  return ntohs(at.sin_port);
}

bool answers(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in at = loopback(port);
  const bool connected = ::connect(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  ::close(socket);
  return connected;
}

}  // namespace

std::string Proxy::missing() { return haproxy().empty() ? "haproxy is not installed; deploy/install does that" : ""; }

Proxy::Proxy(const std::filesystem::path& certificates, const std::filesystem::path& socket) : certificates_(certificates) {
  constexpr int kTries = 5;  // another program may take the port first
  for (int i = 0; i < kTries; ++i) {
    const int port = free_port();
    address_ = "127.0.0.1:" + std::to_string(port);
    ProcessOptions options;
    options.environment = {{"OSTEON_LISTEN", address_},
                           {"OSTEON_CERTIFICATES", certificates_.string()},
                           {"OSTEON_PROXY_SOCKET", socket.string()},
                           {"OSTEON_ADMIN_SOCKET", (dir_ / "admin.sock").string()}};
    options.as_given = true;
    process_.emplace(haproxy(), std::vector<std::string>{"-db", "-f", OSTEON_DEPLOY "/haproxy.cfg"}, options);
    if (wait_until([&] { return !process_->running() || answers(port); }, 20s) && process_->running()) return;
  }
  throw std::runtime_error("haproxy does not start: " + log());
}

void Proxy::tell_who_was_revoked() {
  ProcessOptions options;
  options.as_given = true;
  const RunResult told = run(OSTEON_DEPLOY "/proxy-revoked", {dir_ / "admin.sock", certificates_}, 20s, options);
  if (told.exit_code != 0) throw std::runtime_error("deploy/proxy-revoked failed: " + told.err);
}

}  // namespace osteon::test
