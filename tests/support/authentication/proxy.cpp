#include "tests/support/authentication/proxy.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
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

bool answers(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in at = loopback(port);
  const bool connected = ::connect(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  ::close(socket);
  return connected;
}

// Throws if the configuration does not contain one of the words.
void write_changed(const std::filesystem::path& from, const std::filesystem::path& to, const Proxy::Changes& changes) {
  std::ifstream in(from);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const auto& [what, by] : changes) {
    const std::size_t at = text.find(what);
    if (at == std::string::npos) throw std::runtime_error(from.string() + " does not say " + what);
    text.replace(at, what.size(), by);
  }
  std::ofstream(to) << text;
}

}  // namespace

int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in at = loopback(0);
  socklen_t size = sizeof at;
  (void)::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at);
  (void)::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size);
  ::close(socket);
  return ntohs(at.sin_port);
}

std::string Proxy::missing() { return haproxy().empty() ? "haproxy is not installed; deploy/install does that" : ""; }

Proxy::Proxy(const std::filesystem::path& certificates, const std::filesystem::path& socket, const Changes& changes) {
  const std::filesystem::path configuration = dir_ / "haproxy.cfg", admin = dir_ / "admin.sock";
  write_changed(OSTEON_DEPLOY "/haproxy.cfg", configuration, changes);
  constexpr int kTries = 5;  // another program may take the port first
  for (int i = 0; i < kTries; ++i) {
    const int port = free_port();
    address_ = "127.0.0.1:" + std::to_string(port);
    ProcessOptions options;
    options.environment = {{"OSTEON_LISTEN", address_},
                           {"OSTEON_CERTIFICATES", certificates.string()},
                           {"OSTEON_PROXY_SOCKET", socket.string()},
                           {"OSTEON_ADMIN_SOCKET", admin.string()}};
    process_.emplace(haproxy(), std::vector<std::string>{"-db", "-f", configuration}, options);
    if (!wait_until([&] { return !process_->running() || answers(port); }, 20s) || !process_->running()) continue;
    options.environment.clear();
    revoked_.emplace(OSTEON_DEPLOY "/proxy-revoked", std::vector<std::string>{"--watch", admin, certificates}, options);
    return;
  }
  throw std::runtime_error("haproxy does not start: " + log());
}

bool Proxy::is_told_of(int revoked) {
  return revoked_->wait_for_out("knows of " + std::to_string(revoked) + " revoked", 20s);
}

}  // namespace osteon::test
