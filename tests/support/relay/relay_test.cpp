// Checks counts, never times: durations depend on the machine.
#include <gtest/gtest.h>
#include <asio/connect.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/ip/udp.hpp>
#include <asio/read.hpp>
#include <asio/write.hpp>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <set>
#include <thread>

#include "common/link/udp_port.hpp"
#include "tests/support/relay/impair_process.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using asio::ip::tcp;

std::unique_ptr<UdpPort> port() {
  auto opened = UdpPort::open({});
  EXPECT_TRUE(opened);
  return std::move(*opened);
}

Endpoint endpoint(const std::string& address) {
  const auto colon = address.rfind(':');
  const int number = std::stoi("0" + address.substr(colon + 1));
  const auto found = find_endpoint(address.substr(0, colon), static_cast<std::uint16_t>(number));
  EXPECT_TRUE(found) << address;
  return found.value_or(Endpoint{});
}

std::string numbered(std::uint32_t n) { return {reinterpret_cast<const char*>(&n), sizeof n}; }

void send(UdpPort& from, const Endpoint& to, const std::string& bytes) {
  from.send(to, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

// All that arrives until nothing has arrived for a while: numbers in order of arrival, and the sender of the last.
struct Arrived {
  std::vector<std::uint32_t> numbers;
  Endpoint from;
};
Arrived drain(UdpPort& at, std::chrono::milliseconds quiet = 400ms) {
  Arrived out;
  DatagramBuffer buffer;
  for (auto last = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - last < quiet;) {
    at.wait(10ms);
    while (const auto got = at.receive(buffer)) {
      std::uint32_t n = 0;
      std::memcpy(&n, got->bytes.data(), std::min(sizeof n, got->bytes.size()));
      out.numbers.push_back(n);
      out.from = got->from;
      last = std::chrono::steady_clock::now();
    }
  }
  return out;
}

TEST(Impair, ForwardsDatagramsAndTheirAnswers) {
  const auto server = port(), client = port(), other = port();
  ImpairProcess relay({"--udp", to_string(server->local())});
  const Endpoint there = endpoint(relay.udp());
  send(*client, there, numbered(1));
  const Endpoint client_seen = drain(*server).from;
  send(*other, there, numbered(2));
  const Endpoint other_seen = drain(*server).from;
  EXPECT_NE(client_seen, other_seen) << "each client has its own port towards the server";
  send(*server, other_seen, numbered(20));
  send(*server, client_seen, numbered(10));
  EXPECT_EQ(drain(*client).numbers, std::vector<std::uint32_t>{10});
  EXPECT_EQ(drain(*other).numbers, std::vector<std::uint32_t>{20});
  // Behind new ports the server sees another address, and its answers still find the client.
  EXPECT_EQ(relay.command("rebind"), "ok");
  send(*client, there, numbered(3));
  const Endpoint moved = drain(*server).from;
  EXPECT_NE(moved, client_seen);
  send(*server, moved, numbered(30));
  EXPECT_EQ(drain(*client).numbers, std::vector<std::uint32_t>{30});
  EXPECT_EQ(relay.command("counts"), "ok udp 6 0 0 0 tcp 0 0");
}

TEST(Impair, LosesRepeatsAndReordersAsConfigured) {
  const auto server = port(), client = port();
  ImpairProcess relay({"--udp", to_string(server->local()), "--loss", "0.3", "--duplicate", "0.05", "--reorder", "0.1",
                       "--delay-ms", "5", "--jitter-ms", "2", "--seed", "7"});
  const Endpoint there = endpoint(relay.udp());
  constexpr std::uint32_t kSent = 2000;
  for (std::uint32_t n = 0; n < kSent; ++n) {
    send(*client, there, numbered(n));
    if (n % 20 == 19) std::this_thread::sleep_for(2ms);  // so that no buffer of the system overflows
  }
  const auto numbers = drain(*server, 1500ms).numbers;
  unsigned long long given = 0, lost = 0, twice = 0, held_back = 0;
  const std::string counts = relay.command("counts");
  ASSERT_EQ(std::sscanf(counts.c_str(), "ok udp %llu %llu %llu %llu", &given, &lost, &twice, &held_back), 4) << counts;
  EXPECT_EQ(given, kSent);
  EXPECT_NEAR(static_cast<double>(lost), 0.3 * kSent, 5 * std::sqrt(0.21 * kSent));
  EXPECT_NEAR(static_cast<double>(twice), 0.05 * 0.7 * kSent, 5 * std::sqrt(0.035 * kSent));
  EXPECT_NEAR(static_cast<double>(held_back), 0.1 * 0.7 * kSent, 5 * std::sqrt(0.07 * kSent));
  EXPECT_EQ(numbers.size(), given - lost + twice);
  EXPECT_EQ(std::set<std::uint32_t>(numbers.begin(), numbers.end()).size(), given - lost);
  EXPECT_FALSE(std::ranges::is_sorted(numbers));
  std::printf("%llu datagrams: %llu lost, %llu twice, %llu held back\n", given, lost, twice, held_back);
}

TEST(Impair, LosesAllInAPartitionAndNothingAfter) {
  const auto server = port(), client = port();
  ImpairProcess relay({"--udp", to_string(server->local())});
  const Endpoint there = endpoint(relay.udp());
  EXPECT_EQ(relay.command("partition 1000000"), "ok");
  for (std::uint32_t n = 0; n < 100; ++n) send(*client, there, numbered(n));
  EXPECT_TRUE(drain(*server).numbers.empty());
  EXPECT_EQ(relay.command("good"), "ok");
  send(*client, there, numbered(100));
  EXPECT_EQ(drain(*server).numbers, std::vector<std::uint32_t>{100});
  relay.process().signal(SIGUSR1);
  EXPECT_TRUE(wait_until(
      [&] {
        send(*client, there, numbered(101));
        return drain(*server, 50ms).numbers.empty();
      },
      2900ms))
      << "a signal begins one too";
  EXPECT_EQ(relay.command("loss 2"), "loss needs a share from 0 to 1");
  EXPECT_EQ(relay.command("dance"), "no such command: dance");
  EXPECT_EQ(relay.process().terminate(), 0);
}

// A server that sends back what it receives.
class Echo {
 public:
  Echo() : acceptor_(io_, {asio::ip::address_v4::loopback(), 0}), thread_([this] { run(); }) {}
  ~Echo() {
    stopping_ = true;
    tcp::socket last(io_);
    asio::error_code ignored;
    last.connect(acceptor_.local_endpoint(), ignored);
    thread_.join();
  }
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()); }

 private:
  void run() {
    while (true) {
      asio::error_code error;
      tcp::socket peer = acceptor_.accept(error);
      if (stopping_) return;
      std::array<char, 4096> buffer;
      while (!error) {
        const std::size_t size = peer.read_some(asio::buffer(buffer), error);
        if (!error) asio::write(peer, asio::buffer(buffer.data(), size), error);
      }
    }
  }
  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

tcp::socket connect(asio::io_context& io, const std::string& address) {
  tcp::socket socket(io);
  const auto colon = address.rfind(':');
  asio::error_code error;
  const int number = std::stoi("0" + address.substr(colon + 1));
  socket.connect({asio::ip::make_address(address.substr(0, colon)), static_cast<std::uint16_t>(number)}, error);
  EXPECT_FALSE(error) << address << ": " << error.message();
  return socket;
}

TEST(Impair, AStreamStaysWholeAndInOrder) {
  Echo echo;
  ImpairProcess relay({"--tcp", echo.address(), "--loss", "0.02", "--delay-ms", "2", "--jitter-ms", "2", "--reorder",
                       "0.2", "--duplicate", "0.2", "--seed", "3"});
  asio::io_context io;
  tcp::socket socket = connect(io, relay.tcp());
  std::string sent(1'000'000, '\0'), back(sent.size(), '\0');
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<char>(i * 2654435761u >> 13);
  std::thread writer([&] { asio::write(socket, asio::buffer(sent)); });
  asio::read(socket, asio::buffer(back));
  writer.join();
  EXPECT_TRUE(back == sent);
  // A stall: data sent in a partition arrives after it.
  EXPECT_EQ(relay.command("good"), "ok");
  EXPECT_EQ(relay.command("partition 300"), "ok");
  asio::write(socket, asio::buffer("after", 5));
  asio::read(socket, asio::buffer(back.data(), 5));
  EXPECT_EQ(back.substr(0, 5), "after");
  // The end of the stream gets through both ways.
  socket.shutdown(tcp::socket::shutdown_send);
  asio::error_code error;
  asio::read(socket, asio::buffer(back), error);
  EXPECT_EQ(error, asio::error::eof);
  EXPECT_EQ(relay.command("counts"), "ok udp 0 0 0 0 tcp 1 0");
}

TEST(Impair, AResetBreaksTheConnectionAndTheNextOneWorks) {
  Echo echo;
  ImpairProcess relay({"--tcp", echo.address()});
  asio::io_context io;
  for (int round = 1; round <= 3; ++round) {
    tcp::socket socket = connect(io, relay.tcp());
    std::array<char, 3> back{};
    asio::write(socket, asio::buffer("abc", 3));
    asio::read(socket, asio::buffer(back));
    EXPECT_EQ(std::string(back.data(), 3), "abc");
    EXPECT_EQ(relay.command("reset"), "ok");
    asio::error_code error;
    asio::read(socket, asio::buffer(back), error);
    EXPECT_EQ(error, asio::error::connection_reset);
    EXPECT_EQ(relay.command("counts"), "ok udp 0 0 0 0 tcp " + std::to_string(round) + " " + std::to_string(round));
  }
  EXPECT_EQ(relay.command("quit"), "ok");
  EXPECT_EQ(relay.process().wait(10s), 0);
}

TEST(Impair, SaysWhatIsWrongWithItsTargets) {
  const auto said = run(program("osteon-impair"), {"--addresses", "/dev/null", "--udp", "nowhere"});
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_NE(said.err.find("\"nowhere\" is no target"), std::string::npos) << said.err;
}

}  // namespace
}  // namespace osteon::test
