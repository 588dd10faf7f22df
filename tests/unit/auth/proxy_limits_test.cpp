// The limits of the proxy: those of deploy/haproxy.cfg in use, and the numbers that the documentation promises.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/room_server.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/authentication/proxy.hpp"
#include "tests/support/authentication/raw_http2.hpp"
#include "tests/support/content.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::content;
using test::kGetStatus;
using test::kPatience;
using test::RawHttp2;
using testing::HasSubstr;

// TCP connections over which nothing is sent.
class Connected {
 public:
  Connected(const std::string& address, int count) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    for (int i = 0; i < count; ++i) {
      sockets_.push_back({::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), POLLIN, 0});
      EXPECT_EQ(::connect(sockets_.back().fd, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    }
  }
  ~Connected() {
    for (const pollfd& one : sockets_) ::close(one.fd);
  }
  Connected(const Connected&) = delete;
  Connected& operator=(const Connected&) = delete;
  // The number of connections that the other side has closed.
  long closed() {
    (void)::poll(sockets_.data(), sockets_.size(), 0);
    return std::ranges::count_if(sockets_, [](const pollfd& one) { return one.revents != 0; });
  }

 private:
  std::vector<pollfd> sockets_;
};

class ProxyLimits : public ::testing::Test {
 protected:
  // The server itself limits nothing.
  void serve(const test::Proxy::Changes& changes = {}) {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}});
    ASSERT_TRUE(rooms->create("ward", nullptr));
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0",
                                     {.certificates = people_.server(),
                                      .proxy_socket = dir_ / "proxy.sock",
                                      .flood = {.at_once = 1e6, .per_second = 1e6}});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    proxy_.emplace(people_.server(), dir_ / "proxy.sock", changes);
  }
  void SetUp() override {
    if (const std::string missing = test::Proxy::missing(); !missing.empty()) GTEST_SKIP() << missing;
  }
  const std::string& address() { return proxy_->address(); }
  // Begins `calls` calls and resets each at once. The connection ends, and for a while the person gets no other.
  void expect_pause_after(std::uint32_t calls) {
    RawHttp2 line(address(), people_.person("mallory"));
    for (std::uint32_t i = 0; i < calls; ++i)
      if (!line.call(2 * i + 1, kGetStatus) || !line.reset(2 * i + 1)) break;
    EXPECT_TRUE(line.closed_within(kPatience));
    EXPECT_FALSE(RawHttp2(address(), people_.person("mallory")).read(5s).has_value())
        << "the person can connect again at once";
    EXPECT_TRUE(RawHttp2(address(), people_.person("anna")).read(5s).has_value()) << "another person cannot connect";
  }
  // The lines of the proxy's log about mallory's calls.
  long noted() {
    const std::string said = proxy_->log();
    static const std::regex line("\"mallory\" [0-9A-F]+ ");
    return std::distance(std::sregex_iterator(said.begin(), said.end(), line), {});
  }

  test::TempDir dir_;
  test::People people_;
  std::unique_ptr<RoomServer> server_;
  std::optional<test::Proxy> proxy_;
};

TEST_F(ProxyLimits, BoundConnectionsOfAnAddress) {
  // Several threads would count two connections that come at once before they compare, and reject both.
  serve({{"timeout http-request 5s", "timeout http-request 1h"}, {"  maxconn 2000", "  maxconn 2000\n  nbthread 1"}});
  constexpr int kMost = 20, kBeyond = 5;
  Connected all(address(), kMost + kBeyond);
  EXPECT_TRUE(test::wait_until([&] { return all.closed() == kBeyond; }, kPatience)) << all.closed();
}

TEST_F(ProxyLimits, BoundNewConnectionsOfAnAddress) {
  serve({{"timeout http-request 5s", "timeout http-request 1h"}, {"sc0_conn_cur gt 20", "sc0_conn_cur gt 1000"}});
  constexpr int kMost = 40, kBeyond = 15;
  Connected all(address(), kMost + kBeyond);
  EXPECT_TRUE(test::wait_until([&] { return all.closed() >= kBeyond; }, kPatience)) << all.closed();
}

TEST_F(ProxyLimits, BoundCallsOfOneCertificateAtATime) {
  // Several threads would count the last connection's call before those of an earlier one, and reject one of those.
  serve({{"  maxconn 2000", "  maxconn 2000\n  nbthread 1"}});
  constexpr std::uint32_t kConnections = 8, kOfOne = 16;
  std::vector<std::unique_ptr<RawHttp2>> lines;
  const auto begin = [&](std::uint32_t calls) {
    lines.push_back(std::make_unique<RawHttp2>(address(), people_.person("mallory")));
    for (std::uint32_t i = 0; i < calls; ++i) EXPECT_TRUE(lines.back()->call(2 * i + 1, kGetStatus));
  };
  for (std::uint32_t i = 0; i < kConnections; ++i) begin(kOfOne);
  EXPECT_EQ(noted(), 0) << "a call was ended:\n" << proxy_->log();
  begin(1);
  EXPECT_TRUE(lines.back()->closed_within(kPatience));
  EXPECT_TRUE(test::wait_until([&] { return noted() == 1; }, kPatience)) << proxy_->log();
}

// CVE-2023-44487, with a server that limits nothing itself.
TEST_F(ProxyLimits, BoundCallsOfOneCertificateInASecond) {
  serve();
  expect_pause_after(20'000);
  EXPECT_LT(noted(), 2'000) << "lines in the log";
}

TEST_F(ProxyLimits, BoundCallsOfOneCertificateInTenSeconds) {
  const std::pair<std::string, std::string> fewer{"sc2_http_req_rate gt 1500", "sc2_http_req_rate gt 40"};
  serve({fewer, fewer});
  expect_pause_after(60);
}

// The server would refuse the call because of the headers that the proxy leaves out.
TEST_F(ProxyLimits, PassOnOnlyTheHeadersThatCallsNeed) {
  serve();
  std::string ticket = content(people_.ticket("anna", "ward", Role::trainee));
  ticket.pop_back();
  RawHttp2 line(address(), people_.person("anna"));
  const RawHttp2::Headers headers{{"osteon-ticket", ticket}, {"osteon-room-bin", "d2FyZA"}, {"x-strange", "1"}};
  ASSERT_TRUE(line.call(1, kGetStatus, headers) && line.send_empty_message(1));
  constexpr std::uint8_t kDataFrame = 0;
  bool is_answered = false;
  while (const auto frame = line.read(5s)) is_answered = is_answered || frame->type == kDataFrame;
  EXPECT_TRUE(is_answered);
}

// Finds promises of the documentation that the configuration does not keep.
TEST(ShippedLimits, AreThoseOfThePage) {
  const std::string configuration = content(OSTEON_DEPLOY "/haproxy.cfg"),
                    page = content(OSTEON_DEPLOY "/docs/security.md");
  for (const char* line : {"| connections | 500; of one address 20, and 40 new ones in 10 s |",
                           "| calls of one certificate | 300 in 1 s, 1500 in 10 s, begun or reset; 128 at a time |",
                           "| calls over one connection | 16 at a time |",
                           "A certificate that exceeds its calls gets no new\nconnection for a minute.",
                           "| handshake | 25 s: ", "| from the handshake to the first request | 5 s |",
                           "| a connection without a stream | 1 s; without a first call, 5 s |"})
    EXPECT_THAT(page, HasSubstr(line));
  for (const char* line :
       {"  maxconn 500", "  tcp-request connection reject if { sc0_conn_cur gt 20 }",
        "  stick-table type ipv6 size 100k expire 60s store conn_cur,conn_rate(10s)",
        "  tcp-request connection reject if { sc0_conn_rate gt 40 }",
        "  http-request reject if { sc1_http_req_rate gt 300 } or { sc2_http_req_rate gt 1500 }",
        "  http-request sc-inc-gpc0(1) if { sc1_http_req_rate gt 300 } or { sc2_http_req_rate gt 1500 }",
        "  tcp-request session reject if { ssl_c_serial,hex,table_gpc0_rate(of-certificates) gt 0 }",
        "  http-request reject if { sc1_conn_cur gt 128 }", "  tune.h2.max-concurrent-streams 16",
        "  http-request set-log-level silent if { sc1_http_req_rate gt 330 } or { sc2_http_req_rate gt 1530 }",
        "  stick-table type string len 64 size 10k expire 60s store http_req_rate(1s),conn_cur,gpc0,gpc0_rate(60s)",
        "  stick-table type string len 64 size 10k expire 60s store http_req_rate(10s)",
        "  http-request reject unless { ssl_c_used } { ssl_c_verify 0 }",
        "  http-request reject unless { method POST } { req.hdr(content-type) -m beg application/grpc }",
        "  http-request set-header te trailers", "  http-request set-header osteon-client-address %[src]",
        "  timeout http-request 5s", "  timeout http-keep-alive 1s", "  timeout client 25s"})
    EXPECT_THAT(configuration, HasSubstr("\n" + std::string(line) + "\n"));
}

}  // namespace
}  // namespace osteon
