#include "common/link/udp_port.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/wait.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

std::unique_ptr<UdpPort> a_port(const std::string& address = "127.0.0.1", std::uint16_t port = 0) {
  auto opened = UdpPort::open({.address = address, .port = port});
  EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
  return opened ? std::move(*opened) : nullptr;
}

struct Arrival {
  Endpoint from;
  Bytes bytes;
};
// Waits for a datagram that is under way.
std::optional<Arrival> next(UdpPort& port) {
  DatagramBuffer into;
  std::optional<Arrival> came;
  static_cast<void>(test::wait_until(
      [&] {
        if (const auto datagram = port.receive(into))
          came = {datagram->from, {datagram->bytes.begin(), datagram->bytes.end()}};
        return came.has_value();
      },
      10s));
  return came;
}

// The socket of this process that is bound to this port.
int socket_bound_to(std::uint16_t port) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int number = std::stoi(entry.path().filename());
    sockaddr_in bound{};
    socklen_t size = sizeof(bound);
    if (getsockname(number, reinterpret_cast<sockaddr*>(&bound), &size) == 0 && bound.sin_family == AF_INET &&
        ntohs(bound.sin_port) == port)
      return number;
  }
  return -1;
}

TEST(UdpPort, CarriesDatagramsBothWaysAndSaysWhoseTheyAre) {
  const auto server = a_port(), client = a_port();
  ASSERT_TRUE(server && client);
  EXPECT_EQ(to_string(server->local()).rfind("127.0.0.1:", 0), 0u) << to_string(server->local());
  EXPECT_NE(server->local(), client->local());
  for (const std::size_t size : {std::size_t{1}, std::size_t{29}, kMostDatagramBytes, std::size_t{0}}) {
    const Bytes sent(size, static_cast<std::uint8_t>(size));
    client->send(server->local(), sent);
    const auto came = next(*server);
    ASSERT_TRUE(came) << size;
    EXPECT_EQ(came->from, client->local());
    EXPECT_EQ(came->bytes, sent);
    server->send(came->from, came->bytes);
    const auto back = next(*client);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->from, server->local());
    EXPECT_EQ(back->bytes, sent);
  }
  EXPECT_EQ(server->counts().received, 4u);
  EXPECT_EQ(server->counts().sent, 4u);
  DatagramBuffer into;
  EXPECT_FALSE(server->receive(into)) << "there is no further datagram";
}

TEST(UdpPort, ServesManyPeersFromOneSocket) {
  const auto server = a_port();
  std::vector<std::unique_ptr<UdpPort>> clients;
  for (std::uint8_t i = 0; i < 20; ++i) {
    clients.push_back(a_port());
    clients.back()->send(server->local(), Bytes{i});
  }
  for (int i = 0; i < 20; ++i) {
    const auto came = next(*server);
    ASSERT_TRUE(came);
    EXPECT_EQ(came->from, clients[came->bytes.at(0)]->local());
  }
}

TEST(UdpPort, DropsWhatIsLongerThanADatagramMayBe) {
  const auto server = a_port();
  const int raw = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(server->local().port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (const std::size_t size : {kMostDatagramBytes + 1, std::size_t{60000}, kMostDatagramBytes}) {
    const Bytes bytes(size, 7);
    EXPECT_EQ(sendto(raw, bytes.data(), size, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to)),
              static_cast<ssize_t>(size));
  }
  close(raw);
  const auto came = next(*server);
  ASSERT_TRUE(came);
  EXPECT_EQ(came->bytes.size(), kMostDatagramBytes);
  EXPECT_EQ(server->counts().dropped, 2u);
  EXPECT_EQ(server->counts().received, 1u);
}

// ICMP reports a port without a program. Systems differ in which sockets receive that report, so the test asks the
// kernel for it.
TEST(UdpPort, OutlivesAPeerThatRefuses) {
  const auto port = a_port(), other = a_port();
  const int on = 1;
  ASSERT_EQ(setsockopt(socket_bound_to(port->local().port), IPPROTO_IP, IP_RECVERR, &on, sizeof(on)), 0);
  const Endpoint nobody = a_port()->local();  // It is closed again at once.
  DatagramBuffer into;
  for (int i = 0; i < 5; ++i) {
    port->send(nobody, Bytes{1});
    EXPECT_FALSE(port->receive(into));
  }
  EXPECT_GT(port->counts().receive_failed + port->counts().send_failed, 0u) << "the refusal was reported";
  other->send(port->local(), Bytes{2});
  const auto came = next(*port);
  ASSERT_TRUE(came);
  port->send(nobody, Bytes{1});
  port->wait(1s);  // A report is no datagram either.
  port->send(other->local(), Bytes{3});
  port->send(other->local(), Bytes{3});
  EXPECT_TRUE(next(*other));
}

TEST(UdpPort, WaitsForADatagramOrACall) {
  const auto server = a_port(), client = a_port();
  DatagramBuffer into;
  EXPECT_FALSE(server->wait(0s));
  // Each of these waits would last a day if nothing ended it.
  for (int i = 0; i < 3; ++i) {
    client->send(server->local(), Bytes{1});
    EXPECT_TRUE(server->wait(24h));
    while (!server->receive(into)) server->wait(24h);
  }
  client->send(server->local(), Bytes{1});  // Two are sent and one is taken. The other can end any wait.
  client->send(server->local(), Bytes{2});
  EXPECT_TRUE(server->wait(24h));
  while (!server->receive(into)) server->wait(24h);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(server->wait(24h));
  while (!server->receive(into)) server->wait(24h);

  std::atomic<bool> called{false};
  std::thread caller([&] {
    called = true;
    server->wake();
  });
  while (!called) server->wait(24h);
  caller.join();
  server->wake();  // Called before the wait.
  EXPECT_TRUE(server->wait(24h));
  for (int i = 0; i < 1000; ++i) server->wake();
  EXPECT_TRUE(server->wait(24h));
  int more = 0;
  while (server->wait(0s)) ++more;
  EXPECT_LE(more, 1) << "a thousand calls end one wait, and a datagram taken since may have ended one more";
  EXPECT_FALSE(server->receive(into));
}

TEST(UdpPort, GivesItsPortFreeWhenClosed) {
  auto first = a_port();
  const std::uint16_t number = first->local().port;
  const auto taken = UdpPort::open({.port = number});
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::unavailable);
  EXPECT_NE(taken.error().message.find(std::to_string(number)), std::string::npos) << taken.error().message;
  first->wait(0s);  // something waits on it
  first.reset();
  EXPECT_EQ(a_port("127.0.0.1", number)->local().port, number);
}

TEST(UdpPort, RefusesAddressesThatAreNotHere) {
  const auto name = UdpPort::open({.address = "not an address"});
  ASSERT_FALSE(name);
  EXPECT_EQ(name.error().code, ErrorCode::invalid_input);
  const auto elsewhere = UdpPort::open({.address = "192.0.2.1"});  // RFC 5737: nobody has this address.
  ASSERT_FALSE(elsewhere);
  EXPECT_EQ(elsewhere.error().code, ErrorCode::unavailable);
}

TEST(UdpPort, ReceivesOnAnyAddress) {
  const auto server = a_port("0.0.0.0"), client = a_port();
  Endpoint to = client->local();
  to.port = server->local().port;
  client->send(to, Bytes{1});
  const auto came = next(*server);
  ASSERT_TRUE(came);
  EXPECT_EQ(came->from, client->local());
}

// If the machine has IPv6, a port of both families shows the address of an IPv4 peer as an IPv4 port does. If not,
// opening fails with a message.
TEST(UdpPort, ReceivesFromBothFamilies) {
  const auto both = UdpPort::open({.address = "::"});
  if (!both) {
    EXPECT_EQ(both.error().code, ErrorCode::unavailable);
    return;
  }
  const auto v4 = a_port();
  Endpoint to = v4->local();
  to.port = (*both)->local().port;
  v4->send(to, Bytes{4});
  const auto came = next(**both);
  ASSERT_TRUE(came);
  EXPECT_EQ(came->from, v4->local());
  (*both)->send(came->from, Bytes{5});
  EXPECT_TRUE(next(*v4));
  // IPv4 cannot reach an address of IPv6: the datagram is lost, and counted.
  v4->send({0, 1, to.port}, Bytes{6});
  EXPECT_EQ(v4->counts().send_failed, 1u);
  if (const auto v6 = UdpPort::open({.address = "::1"})) {
    (*v6)->send({0, 1, to.port}, Bytes{6});
    const auto from_v6 = next(**both);
    ASSERT_TRUE(from_v6);
    EXPECT_EQ(from_v6->from, (*v6)->local());
    EXPECT_EQ(from_v6->from.low, 1u);
  }
}

TEST(FindEndpoint, KnowsNumbersAndThisMachine) {
  const auto v4 = find_endpoint("127.0.0.1", 5000);
  ASSERT_TRUE(v4);
  EXPECT_EQ(to_string(*v4), "127.0.0.1:5000");
  const auto v6 = find_endpoint("::1", 5000);
  ASSERT_TRUE(v6);
  EXPECT_EQ(*v6, (Endpoint{0, 1, 5000}));
  const std::string no_name(70, 'a');  // RFC 1035: a label has at most 63 bytes, so no name server is asked
  const auto none = find_endpoint(no_name, 5000);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
  EXPECT_NE(none.error().message.find(no_name), std::string::npos);
}

}  // namespace
}  // namespace osteon
