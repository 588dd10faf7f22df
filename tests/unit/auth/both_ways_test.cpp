// The same people, wrong certificates and attacks, directly at the server and through the proxy of deploy/haproxy.cfg.
// Both ways have the same results.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <numeric>
#include <optional>
#include <regex>
#include <sstream>
#include <string>

#include "common/wire/room_client.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/authentication/proxy.hpp"
#include "tests/support/authentication/raw_http2.hpp"
#include "tests/support/authentication/wrong_certificates.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/relay/impair_process.hpp"
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

constexpr const char* kWatch = "/osteon.v1.WatchService/WatchCutting";
constexpr std::uint8_t kDataFrame = 0, kHeadersFrame = 1;

enum class Way { direct, proxy };

class BothWays : public ::testing::TestWithParam<Way> {
 protected:
  void SetUp() override {
    if (const std::string missing = test::Proxy::missing(); is_proxied() && !missing.empty()) GTEST_SKIP() << missing;
    anna_ = people_.credentials("anna", Role::trainee, "ward");
    (void)people_.person("mallory");
  }
  void TearDown() override {
    if (!server_) return;
    // Anna can still join, whatever was tried.
    const auto joined = wire::join_room(address(), wire::ClientKind::viewer, "anna", 5s, {}, "ward", anna_);
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    EXPECT_TRUE(!proxy_ || proxy_->running());
    if (capturing_) (void)log();
  }
  [[nodiscard]] static bool is_proxied() { return GetParam() == Way::proxy; }
  void serve(ConnectionOptions doors = {}, const test::Proxy::Changes& changes = {}) {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}});
    ASSERT_TRUE(rooms->create("ward", nullptr));
    doors.certificates = people_.server();
    if (is_proxied()) doors.proxy_socket = dir_ / "proxy.sock";
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0", doors);
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    if (is_proxied()) proxy_.emplace(people_.server(), doors.proxy_socket, changes);
    testing::internal::CaptureStdout();  // A program that has not opened its log writes it here.
    capturing_ = true;
  }
  // The address that clients connect to.
  const std::string& address() { return proxy_ ? proxy_->address() : server_->address(); }
  // What the server and the proxy have logged since their start. May be called once.
  std::string log() {
    capturing_ = false;
    const std::string said = testing::internal::GetCapturedStdout() + (proxy_ ? proxy_->log() : "");
    std::cout << said;  // The log also contains the failures so far.
    return said;
  }
  // The headers with which the server admits a person's call.
  RawHttp2::Headers admission(const std::string& user) {
    const std::string room_in_base64 = "d2FyZA";  // ward
    std::string ticket = content(people_.ticket(user, "ward", Role::trainee));
    ticket.pop_back();
    return {{"osteon-ticket", ticket}, {"osteon-room-bin", room_in_base64}};
  }
  // Whether a frame of this kind is received before the connection ends.
  static bool comes(RawHttp2& line, std::uint8_t kind) {
    while (const auto frame = line.read(5s))
      if (frame->type == kind) return true;
    return false;
  }
  // Whether somebody with this certificate and a ticket in their name is sent anything about the room.
  bool is_informed(const std::filesystem::path& person, const std::string& user) {
    RawHttp2 line(address(), person);
    return line.call(1, kGetStatus, admission(user)) && line.send_empty_message(1) && comes(line, kDataFrame);
  }
  std::uint64_t refusals() {
    const auto counts = server_->rooms().refusals.counts();
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0},
                           [](std::uint64_t sum, const auto& one) { return sum + one.second; });
  }
  // Number of lines in which the proxy logs a call, or a failed handshake, with its address.
  std::size_t noted_by_proxy() {
    if (!proxy_) return 0;
    const std::string said = proxy_->log();
    static const std::regex line("127\\.0\\.0\\.1:[0-9]+ ");
    return static_cast<std::size_t>(std::distance(std::sregex_iterator(said.begin(), said.end(), line), {}));
  }
  // Whether a line of a log names that person and the address: the server writes the address after the name, the proxy
  // before it.
  static bool is_named(const std::string& said, const std::string& user) {
    const std::regex server("refused who=\"?" + user + "\\b.* from=\"?(ipv4:)?127\\.0\\.0\\.1\\b"),
        proxy("^127\\.0\\.0\\.1:[0-9]+ \\[[^\\]]*\\] \"" + user + "\" [0-9A-F]+ ");
    std::istringstream lines(said);
    for (std::string line; std::getline(lines, line);)
      if (std::regex_search(line, server) || std::regex_search(line, proxy)) return true;
    return false;
  }
  // An open stream of somebody who has joined.
  std::unique_ptr<RawHttp2> stream_of(const std::string& user) {
    const wire::ClientCredentials credentials = people_.credentials(user, Role::trainee, "ward");
    const auto joined = wire::join_room(address(), wire::ClientKind::viewer, user, 5s, {}, "ward", credentials);
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    auto line = std::make_unique<RawHttp2>(address(), people_.person(user));
    const char author = static_cast<char>(joined.value().author.value);
    EXPECT_TRUE(line->call(1, kWatch, admission(user)) && line->send_message(1, std::string{'\x08', author}));
    EXPECT_TRUE(comes(*line, kDataFrame)) << user;
    return line;
  }

  test::TempDir dir_;
  test::People people_;
  wire::ClientCredentials anna_;
  std::unique_ptr<RoomServer> server_;
  std::optional<test::Proxy> proxy_;
  bool capturing_ = false;
};
INSTANTIATE_TEST_SUITE_P(To, BothWays, testing::Values(Way::direct, Way::proxy),
                         [](const auto& one) { return one.param == Way::direct ? "TheServer" : "TheProxy"; });

TEST_P(BothWays, RefuseEveryWrongCertificateAndNoteItsAddress) {
  const auto wrong = test::wrong_certificates(people_, dir_ / "wrong");
  ASSERT_GE(wrong.size(), 13u);
  serve();
  EXPECT_TRUE(is_informed(people_.person("anna"), "anna")) << "the right certificate was refused";
  const std::uint64_t admitted = server_->connection_health().authorizer.admitted;
  for (const test::WrongCertificate& one : wrong) {
    SCOPED_TRACE(one.kind);
    const std::uint64_t noted = refusals() + noted_by_proxy();
    EXPECT_FALSE(is_informed(one.folder, one.user));
    EXPECT_TRUE(test::wait_until([&] { return refusals() + noted_by_proxy() > noted; }, kPatience))
        << "no log has a line about it";
  }
  EXPECT_EQ(server_->connection_health().authorizer.admitted, admitted);
  EXPECT_TRUE(is_informed(people_.person("anna"), "anna"));
  EXPECT_THAT(log(), HasSubstr("127.0.0.1"));
}

// If each round trip takes 150 ms, a handshake takes half a second.
TEST_P(BothWays, AdmitPeopleOverASlowConnection) {
  serve();
  const test::ImpairProcess line({"--tcp", address(), "--delay-ms", "75"});
  const auto joined = wire::join_room(line.tcp(), wire::ClientKind::viewer, "anna", 5s, {}, "ward", anna_);
  EXPECT_TRUE(joined.has_value()) << joined.error().message;
}

// A client that prefers a weaker cipher gets the cipher that the server prefers.
TEST_P(BothWays, ChooseTheCipherThemselves) {
  serve();
  const auto chosen = [&](const std::string& offered) {
    const std::filesystem::path person = people_.person("anna");
    const test::RunResult said =
        test::run("openssl", {"s_client", "-connect", address(), "-tls1_2", "-cipher", offered, "-alpn", "h2", "-cert",
                              person / "person.pem", "-key", person / "person.key"});
    std::smatch found;
    return std::regex_search(said.out, found, std::regex("Cipher is (\\S+)")) ? found[1].str() : "";
  };
  const std::string strong = "ECDHE-ECDSA-AES256-GCM-SHA384", other = "ECDHE-ECDSA-AES128-GCM-SHA256";
  const std::string first = chosen(strong + ":" + other);
  EXPECT_THAT(first, testing::AnyOf(strong, other));
  EXPECT_EQ(chosen(other + ":" + strong), first);
}

TEST_P(BothWays, CloseWhatIsOpenOfWhoIsRevoked) {
  serve();
  const auto mallorys = stream_of("mallory"), annas = stream_of("anna");
  RawHttp2 of_no_call(address(), people_.person("mallory"));
  ASSERT_TRUE(of_no_call.read(5s).has_value());  // The settings were received: the handshake is complete.
  people_.certs({"revoke", "mallory"});
  EXPECT_TRUE(mallorys->closed_within(kPatience));
  EXPECT_TRUE(of_no_call.closed_within(kPatience));
  EXPECT_TRUE(!proxy_ || proxy_->is_told_of(1));
  EXPECT_FALSE(RawHttp2(address(), people_.person("mallory")).read(5s)) << "a new connection was accepted";
  EXPECT_FALSE(annas->closed_within(1s)) << "the stream of somebody else was closed";
}

// gRPC 1.51 ends the process when an AuthMetadataProcessor receives such a header.
TEST_P(BothWays, SurviveAHeaderThatOnceEndedTheServer) {
  people_.certs({"revoke", "mallory"});
  serve();
  const RawHttp2::Headers killing{{"grpclb_client_stats", "x"}};
  const auto call = [&](const std::filesystem::path& person, const char* path) {
    RawHttp2 line(address(), person);
    return line.call(1, path, killing) && line.send_empty_message(1) && comes(line, kHeadersFrame);
  };
  for (const char* path : {kGetStatus, "/osteon.v1.CuttingService/Session", "/osteon.v1.RoomService/Nothing"}) {
    EXPECT_TRUE(call(people_.person("ben"), path)) << "is answered, with a refusal";
    EXPECT_FALSE(call(people_.person("mallory"), path)) << "the certificate is revoked";
    EXPECT_FALSE(call({}, path)) << "there is no certificate";
  }
  EXPECT_EQ(server_->connection_health().authorizer.admitted, 0u);
  const std::string said = log();
  EXPECT_TRUE(is_named(said, "ben"));
  EXPECT_TRUE(is_named(said, "mallory"));
}

// CVE-2023-44487: calls that are begun and reset, without waiting.
TEST_P(BothWays, SurviveRapidResetsOfCalls) {
  people_.certs({"revoke", "mallory"});
  serve();
  for (const std::filesystem::path& person :
       {people_.person("ben"), people_.person("mallory"), std::filesystem::path()}) {
    SCOPED_TRACE(person);
    RawHttp2 line(address(), person);
    for (std::uint32_t stream = 1; stream < 40'001; stream += 2)
      if (!line.call(stream, kGetStatus) || !line.reset(stream)) break;
    EXPECT_TRUE(line.closed_within(kPatience)) << "the attack could go on for ever";
  }
  EXPECT_LT(server_->connection_health().authorizer.admitted + server_->connection_health().authorizer.refused, 8'000u);
  const std::string said = log();
  EXPECT_TRUE(is_named(said, "ben"));
  EXPECT_TRUE(is_named(said, "mallory"));
}

// A pulled cable: the server detects it by itself. With the times of the shipped configuration it takes less than 30 s,
// see below.
TEST_P(BothWays, EndTheStreamsOfAMachineThatAnswersNothing) {
  serve({.keepalive = 500ms}, {{"clitcpka-idle 10s", "clitcpka-idle 1s"},
                               {"clitcpka-intvl 5s", "clitcpka-intvl 1s"},
                               {"clitcpka-cnt 3", "clitcpka-cnt 2"},
                               {"tcp-ut 25s", "tcp-ut 2s"}});
  const auto mallorys = stream_of("mallory");
  ASSERT_EQ(server_->connection_health().authorizer.streams, 1u);
  mallorys->go_deaf();
  EXPECT_TRUE(test::wait_until([&] { return server_->connection_health().authorizer.streams == 0; }, kPatience));
}

// The number of seconds that the configuration sets for this word.
int seconds(const std::string& configuration, const std::string& word, const std::string& unit = "s") {
  std::smatch found;
  if (!std::regex_search(configuration, found, std::regex("\n[^#\n]*\\b" + word + " ([0-9]+)" + unit + "\\b"))) {
    ADD_FAILURE() << "haproxy.cfg does not contain " << word;
    return 0;
  }
  return std::stoi(found[1]);
}

TEST(ShippedTimes, EndADeadClientWithin30Seconds) {
  constexpr int kMost = 30;
  const std::string proxy = content(OSTEON_DEPLOY "/haproxy.cfg");
  EXPECT_LE(seconds(proxy, "clitcpka-idle") + seconds(proxy, "clitcpka-intvl") * seconds(proxy, "clitcpka-cnt", ""),
            kMost);
  EXPECT_NE(proxy.find("\n  option clitcpka\n"), std::string::npos);
  EXPECT_LE(seconds(proxy, "tcp-ut"), kMost) << "something was sent to the client";
  EXPECT_LE(seconds(proxy, "timeout client"), kMost) << "the client takes nothing of what waits for it";
  EXPECT_LE(2 * std::chrono::duration_cast<std::chrono::seconds>(ConnectionOptions{}.keepalive).count(), kMost)
      << "the client is asked after that time, and has as long to answer";
}

// systemd's own checker checks the unit, with an existing program in place of the script.
TEST(ShippedUnits, OfTheProxyAreAsSystemdWantsThem) {
  const std::string configuration = content(OSTEON_DEPLOY "/haproxy.cfg");
  EXPECT_THAT(configuration, HasSubstr("OSTEON_ADMIN_SOCKET /run/osteon-proxy/admin.sock\n"));
  EXPECT_THAT(configuration, HasSubstr("OSTEON_PROXY_SOCKET /run/osteon/proxy.sock\n"));
  EXPECT_THAT(content(OSTEON_DEPLOY "/systemd/osteon-server.service"), HasSubstr("\nRuntimeDirectory=osteon\n"));
  if (!std::filesystem::exists("/usr/bin/systemd-analyze")) GTEST_SKIP() << "systemd-analyze is not installed";
  if (const std::string missing = test::Proxy::missing(); !missing.empty()) GTEST_SKIP() << missing;
  const test::TempDir folder;
  for (const char* name : {"osteon-server.service", "osteon-proxy.service", "osteon-proxy-revoked.service"})
    std::ofstream(folder / name) << std::regex_replace(content(std::filesystem::path(OSTEON_DEPLOY) / "systemd" / name),
                                                       std::regex("/usr/local/bin/[a-z-]+"), "/usr/bin/true");
  for (const char* name : {"osteon-proxy.service", "osteon-proxy-revoked.service"}) {
    const std::string unit = content(folder / name);
    // Only the server's user can open its socket, and the proxy's.
    EXPECT_THAT(unit, HasSubstr("\nDynamicUser=yes\nUser=osteon-server\n")) << name;
    EXPECT_THAT(unit, HasSubstr("\nInaccessiblePaths=-/var/lib/osteon -/var/lib/private\n")) << name;
    const test::RunResult verified = test::run("systemd-analyze", {"verify", folder / name}, 60s);
    EXPECT_EQ(verified.exit_code, 0) << verified.err;
    EXPECT_EQ(verified.err, "") << "the checker only warns of unknown settings";
    const test::RunResult exposed =
        test::run("systemd-analyze", {"security", "--offline=true", "--threshold=20", folder / name}, 60s);
    EXPECT_EQ(exposed.exit_code, 0) << exposed.out << exposed.err;
  }
}

}  // namespace
}  // namespace osteon
