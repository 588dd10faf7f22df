// People who have or had a certificate of the authority, and send over HTTP/2 what none of our clients would. The
// server goes on, others notice nothing, and the log contains the person and the address.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "common/wire/room_client.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/authentication/raw_http2.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::kGetStatus;
using test::kPatience;
using test::RawHttp2;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint8_t kHeadersFrame = 1;
constexpr const char* kSession = "/osteon.v1.CuttingService/Session";

class Insiders : public ::testing::Test {
 protected:
  void SetUp() override {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}});
    ASSERT_TRUE(rooms->create("ward", nullptr));
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0",
                                     {.certificates = people_.server(),
                                      .flood = {.at_once = kCalls, .per_second = 1.0},
                                      .keepalive = 1h});  // A keepalive would close connections too.
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    anna_ = people_.credentials("anna", Role::trainee, "ward");
    (void)people_.person("mallory");
    testing::internal::CaptureStdout();  // A program that has not opened its log writes it here.
    capturing_ = true;
  }
  // Somebody else can still join as before.
  void TearDown() override {
    if (!server_) return;
    const auto joined = wire::join_room(address(), wire::ClientKind::viewer, "anna", 5s, {}, "ward", anna_);
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    if (capturing_) (void)log();
  }
  static constexpr double kCalls = 50;
  const std::string& address() { return server_->address(); }
  std::string log() {
    capturing_ = false;
    // The log also contains the failures so far.
    std::string said = testing::internal::GetCapturedStdout();
    std::cout << said;
    return said;
  }
  // Whether the first stream is answered. False if the connection ends before.
  static bool is_answered(RawHttp2& line) {
    while (const auto frame = line.read(5s))
      if (frame->type == kHeadersFrame) return true;
    return false;
  }
  std::uint64_t counted(const std::string& reason) {
    const auto counts = server_->rooms().refusals.counts();
    const auto found = counts.find(reason);
    return found == counts.end() ? 0 : found->second;
  }

  test::TempDir dir_;
  test::People people_;
  wire::ClientCredentials anna_;
  std::unique_ptr<RoomServer> server_;
  bool capturing_ = false;
};

// gRPC 1.51 ends the process when an AuthMetadataProcessor receives the first of these.
TEST_F(Insiders, AreRefusedForHeadersThatNoClientHas) {
  const RawHttp2::Headers strange[] = {{{"grpclb_client_stats", "x"}},
                                       {{"lb-token", "x"}},
                                       {{"lb-cost-bin", "x"}},
                                       {{"grpc-tags-bin", "x"}},
                                       {{"x-osteon-certificate", "x"}},
                                       {{"grpc-previous-rpc-attempts", "1"}},
                                       {{"grpc-retry-pushback-ms", "1"}},
                                       {{"endpoint-load-metrics-bin", "x"}}};
  for (const RawHttp2::Headers& headers : strange)
    for (const char* path : {kGetStatus, kSession, "/osteon.v1.RoomService/Nothing", "/grpc.health.v1.Health/Check"}) {
      RawHttp2 line(address(), people_.person("mallory"));
      ASSERT_TRUE(line.call(1, path, headers) && line.send_empty_message(1));
      EXPECT_TRUE(is_answered(line)) << path << " " << headers.front().first;
    }
  // Nobody was admitted without a ticket. Without a strange header, that is the only reason.
  EXPECT_EQ(server_->connection_health().authorizer.admitted, 0u);
  RawHttp2 line(address(), people_.person("mallory"));
  ASSERT_TRUE(line.call(1, kSession));
  EXPECT_TRUE(is_answered(line));
  const std::string said = log();
  EXPECT_THAT(said, HasSubstr("a header that this server does not know; leave out "));
  EXPECT_THAT(said, HasSubstr("no ticket came with the call"));
  EXPECT_THAT(said, HasSubstr("mallory"));
  EXPECT_THAT(said, HasSubstr("ipv4:127.0.0.1"));
}

TEST_F(Insiders, WhoAreRevokedFailInTheHandshake) {
  people_.certs({"revoke", "mallory"});
  ASSERT_TRUE(test::wait_until(
      [&] {
        RawHttp2 line(address(), people_.person("mallory"));
        (void)line.call(1, kGetStatus, {{"grpclb_client_stats", "x"}});
        return !line.read(5s);
      },
      kPatience));
  const std::uint64_t refused = server_->connection_health().authorizer.refused;
  for (int i = 0; i < 5; ++i) {
    RawHttp2 line(address(), people_.person("mallory"));
    (void)line.call(1, kGetStatus, {{"grpclb_client_stats", "x"}});
    // The client does not even receive the settings with which an HTTP/2 server begins.
    EXPECT_FALSE(line.read(5s).has_value());
    EXPECT_TRUE(line.closed_within(kPatience));
  }
  EXPECT_EQ(server_->connection_health().authorizer.refused, refused) << "a call passed the handshake";
  EXPECT_GE(counted("revoked"), 5u);
  const std::string said = log();
  EXPECT_THAT(said, HasSubstr("mallory, certificate "));
  EXPECT_THAT(said, HasSubstr("was revoked; ask for a new one"));
  EXPECT_THAT(said, HasSubstr("ipv4:127.0.0.1"));
}

TEST_F(Insiders, WhoAreRevokedLoseTheConnectionsThatTheyHave) {
  RawHttp2 of_a_call(address(), people_.person("mallory"));
  ASSERT_TRUE(of_a_call.call(1, kSession));
  ASSERT_TRUE(is_answered(of_a_call));
  RawHttp2 of_no_call(address(), people_.person("mallory"));
  ASSERT_TRUE(of_no_call.read(5s).has_value());  // The server's settings were received: the handshake is complete.
  const wire::ClientCredentials anna = anna_;
  RawHttp2 annas(address(), people_.person("anna"));
  ASSERT_TRUE(annas.call(1, kSession));
  ASSERT_TRUE(is_answered(annas));

  people_.certs({"revoke", "mallory"});
  EXPECT_TRUE(of_a_call.closed_within(kPatience));
  RawHttp2 newcomer(address(), people_.person("anna"));
  ASSERT_TRUE(newcomer.read(5s).has_value());
  EXPECT_TRUE(of_no_call.closed_within(kPatience));
  EXPECT_TRUE(newcomer.call(1, kSession) && is_answered(newcomer)) << "a person who connected after the revocation";
  EXPECT_FALSE(annas.closed_within(1s)) << "the connection of somebody else was closed";
  EXPECT_TRUE(test::wait_until([&] { return server_->connection_health().connections.open == 2; }, kPatience));
}

// Somebody who has just connected has made no call yet. The revocation of somebody else must not close that connection.
TEST_F(Insiders, LoseNoConnectionThatIsNewWhenSomebodyElseIsRevoked) {
  RawHttp2 mallorys(address(), people_.person("mallory"));
  ASSERT_TRUE(mallorys.call(1, kSession));
  ASSERT_TRUE(is_answered(mallorys));
  RawHttp2 annas(address(), people_.person("anna"));
  ASSERT_TRUE(annas.read(5s).has_value());
  people_.certs({"revoke", "mallory"});
  ASSERT_TRUE(mallorys.closed_within(kPatience));
  ASSERT_TRUE(annas.call(1, kSession));
  EXPECT_TRUE(is_answered(annas));
}

// Somebody who is about to make a first call does not notice a change of somebody else's role.
TEST_F(Insiders, LoseNoConnectionByAChangedRole) {
  RawHttp2 line(address(), people_.person("anna"));
  ASSERT_TRUE(line.read(5s).has_value());
  people_.append_access("role mallory observer ward");
  for (int i = 0; i < 3; ++i) server_->rooms().authorizer->look();
  ASSERT_TRUE(line.call(1, kSession));
  EXPECT_TRUE(is_answered(line));
}

// A revocation list that another authority wrote is obeyed as the server's own list is.
TEST_F(Insiders, AreRevokedByAListOfTheAuthorityAlone) {
  const std::filesystem::path list = people_.server() / "access.txt";
  people_.certs({"revoke", "mallory"});
  ASSERT_TRUE(std::filesystem::exists(people_.server() / "crl.pem"));
  std::ofstream(list) << "# nobody\n";
  EXPECT_TRUE(test::wait_until([&] { return !RawHttp2(address(), people_.person("mallory")).read(5s); }, kPatience));
  EXPECT_TRUE(RawHttp2(address(), people_.person("anna")).read(5s).has_value());
}

// CVE-2023-44487: calls that are begun and reset, without waiting.
TEST_F(Insiders, WhoResetCallsRapidlyAreCutOffAndWait) {
  RawHttp2 line(address(), people_.person("mallory"));
  for (std::uint32_t stream = 1; stream < 40'001; stream += 2)
    if (!line.call(stream, kSession) || !line.reset(stream)) break;
  EXPECT_TRUE(line.closed_within(kPatience));
  EXPECT_GE(counted("flood"), 1u);
  // Calls that gRPC had read before the connection was closed may still begin, but none that waited in the receive
  // queue.
  const std::uint64_t begun =
      server_->connection_health().authorizer.admitted + server_->connection_health().authorizer.refused;
  EXPECT_LT(begun, 2'000u);
  // Once for the connection, and for the calls that other threads begin at that moment.
  EXPECT_LE(counted("flood"), 16u) << "of " << begun;
  // The person cannot connect again at once, over any connection.
  EXPECT_FALSE(RawHttp2(address(), people_.person("mallory")).read(5s).has_value());
  EXPECT_TRUE(RawHttp2(address(), people_.person("anna")).read(5s).has_value());
  const std::string said = log();
  EXPECT_THAT(said, HasSubstr("mallory"));
  EXPECT_THAT(said, HasSubstr("more calls than a person may begin"));
}

// More connections do not allow more calls: all of a person share one limit, and all are closed.
TEST_F(Insiders, ShareOneLimitOverAllTheirConnections) {
  RawHttp2 first(address(), people_.person("mallory")), second(address(), people_.person("mallory"));
  ASSERT_TRUE(first.read(5s).has_value());
  ASSERT_TRUE(second.read(5s).has_value());
  for (std::uint32_t stream = 1; stream < 2 * kCalls; stream += 2) ASSERT_TRUE(first.call(stream, kSession));
  const auto refused = [&] { return server_->connection_health().authorizer.refused; };
  ASSERT_TRUE(test::wait_until([&] { return refused() == static_cast<std::uint64_t>(kCalls); }, kPatience));
  for (std::uint32_t stream = 1; stream < 2 * kCalls; stream += 2)
    if (!second.call(stream, kSession)) break;
  EXPECT_TRUE(second.closed_within(kPatience));
  EXPECT_TRUE(first.closed_within(kPatience));
  EXPECT_GE(counted("flood"), 1u);
}

// Failed handshakes are logged with the address, whatever the reason.
TEST_F(Insiders, AndTheUnauthenticatedAreNotedWithTheirAddress) {
  test::People elsewhere;
  EXPECT_FALSE(RawHttp2(address(), elsewhere.person("anna")).read(5s).has_value());
  EXPECT_FALSE(RawHttp2(address()).read(5s).has_value());
  ASSERT_TRUE(test::wait_until([&] { return counted("certificate") == 1 && counted("tls") >= 1; }, kPatience));
  std::istringstream lines(log());
  int noted = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("refused") == std::string::npos) continue;
    ++noted;
    EXPECT_THAT(line, HasSubstr("ipv4:127.0.0.1"));
  }
  EXPECT_EQ(noted, 2);
}

}  // namespace
}  // namespace osteon
