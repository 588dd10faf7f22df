#include "tests/support/relay/relay.hpp"

#include <unistd.h>
#include <asio/buffer.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/ip/udp.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/read_until.hpp>
#include <asio/signal_set.hpp>
#include <asio/steady_timer.hpp>
#include <asio/streambuf.hpp>
#include <asio/write.hpp>

#include <array>
#include <csignal>
#include <cstdio>
#include <deque>
#include <istream>
#include <list>
#include <map>
#include <sstream>

#include "tests/support/network/virtual_time.hpp"

namespace osteon::test {
namespace {

using asio::ip::tcp;
using asio::ip::udp;
using Time = VirtualTime::Time;
using namespace std::chrono_literals;

constexpr std::size_t kMostPendingBytes =
    256 * 1024;  // of one direction of a TCP connection, before it is read no further
constexpr std::size_t kMostUdpClients = 256;
constexpr Time kRetransmission = 200ms, kSignalPartition = 3s;

std::string error_of(const std::string& what, const asio::error_code& error) { return what + ": " + error.message(); }

// Delayed actions: virtual time driven by the real clock.
class Later {
 public:
  explicit Later(asio::io_context& io) : timer_(io), start_(std::chrono::steady_clock::now()) {}
  [[nodiscard]] Time now() const { return std::chrono::steady_clock::now() - start_; }
  void post(Time at, std::function<void()> action) {
    events_.post(at, std::move(action));
    arm();
  }

 private:
  void arm() {
    const auto next = events_.next_at();
    if (!next) return;
    timer_.expires_at(start_ + *next);
    timer_.async_wait([this](const asio::error_code& error) {
      if (error) return;  // the timer was set again
      events_.run_until(now());
      arm();
    });
  }
  VirtualTime events_;
  asio::steady_timer timer_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace

struct Relay::Impl {
  // One listening UDP port.
  struct UdpSide {
    udp::socket socket;
    udp::endpoint server;
    udp::endpoint from;  // of the datagram being received
    std::array<char, 65536> buffer;
    struct Client {
      explicit Client(asio::io_context& io) : socket(io) {}
      udp::socket socket;  // towards the server
      udp::endpoint client;
      std::array<char, 65536> buffer;
    };
    std::map<udp::endpoint, std::shared_ptr<Client>> clients;  // shared with actions posted for later
  };

  struct TcpLink : std::enable_shared_from_this<TcpLink> {
    explicit TcpLink(asio::io_context& io) : ends{tcp::socket(io), tcp::socket(io)} {}
    std::array<tcp::socket, 2> ends;  // client, server
    struct Direction {                // 0: towards the server
      std::array<char, 16384> buffer;
      std::deque<std::string> arrived;  // to be written; an empty one ends the stream
      std::size_t pending = 0;          // bytes read and not yet written
      Time last{};                      // arrival of the newest
      bool reading = false, writing = false, ended = false;
    };
    std::array<Direction, 2> directions;
    bool open = true;
  };
  struct TcpSide {
    tcp::acceptor acceptor;
    tcp::endpoint server;
  };

  asio::io_context io;
  Later later{io};
  asio::signal_set signals{io, SIGTERM, SIGINT, SIGUSR1};
  asio::posix::stream_descriptor input{io};
  asio::streambuf lines;
  std::list<UdpSide> udp_sides;
  std::list<TcpSide> tcp_sides;
  std::list<std::weak_ptr<TcpLink>> links;
  // Of datagrams and of chunks of streams, each towards the server and back. Each has its own random numbers,
  // independent of the others.
  std::array<Impairment, 2> fates, tcp_fates;
  Time partition_until{};
  std::uint64_t connections = 0, resets = 0;

  explicit Impl(const RelayOptions& options)
      : fates{Impairment(4 * options.seed), Impairment(4 * options.seed + 1)},
        tcp_fates{Impairment(4 * options.seed + 2), Impairment(4 * options.seed + 3)} {
    set(options.quality);
  }

  [[nodiscard]] const PathQuality& quality() const { return fates[0].quality(); }
  void set(const PathQuality& quality) {
    for (auto* each : {&fates, &tcp_fates})
      for (Impairment& fate : *each) fate.set(quality);
  }

  void receive(UdpSide& side) {
    const auto came = [this, &side](const asio::error_code& error, std::size_t size) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        if (const auto client = client_of(side)) {
          pass(fates[0], std::string(side.buffer.data(), size), [&side, client](const std::string& bytes) {
            asio::error_code failed;  // lost, as on the way
            client->socket.send_to(asio::buffer(bytes), side.server, 0, failed);
          });
        }
      }
      receive(side);
    };
    side.socket.async_receive_from(asio::buffer(side.buffer), side.from, came);
  }

  std::shared_ptr<UdpSide::Client> client_of(UdpSide& side) {
    if (const auto known = side.clients.find(side.from); known != side.clients.end()) return known->second;
    if (side.clients.size() >= kMostUdpClients) return {};
    auto client = std::make_shared<UdpSide::Client>(io);
    client->client = side.from;
    asio::error_code error;
    client->socket.open(side.server.protocol(), error);
    if (!error) client->socket.bind(udp::endpoint(side.server.protocol(), 0), error);
    if (error) return {};
    client->socket.non_blocking(true, error);
    side.clients.emplace(side.from, client);
    answer(side, client);
    return client;
  }

  void answer(UdpSide& side, const std::shared_ptr<UdpSide::Client>& client) {
    const auto came = [this, &side, client](const asio::error_code& error, std::size_t size) {
      if (error == asio::error::operation_aborted || error == asio::error::bad_descriptor) return;
      if (!error) {
        pass(fates[1], std::string(client->buffer.data(), size), [&side, client](const std::string& bytes) {
          asio::error_code failed;
          side.socket.send_to(asio::buffer(bytes), client->client, 0, failed);
        });
      }
      answer(side, client);
    };
    client->socket.async_receive(asio::buffer(client->buffer), came);
  }

  void pass(Impairment& fate, const std::string& bytes, const std::function<void(const std::string&)>& deliver) {
    const Time now = later.now();
    if (now < partition_until) return;
    for (const Impairment::Copy& copy : fate.pass(now, bytes.size())) {
      std::string arriving = bytes;
      if (copy.spoiled) fate.spoil({reinterpret_cast<std::uint8_t*>(arriving.data()), arriving.size()});
      later.post(copy.at, [deliver, arriving = std::move(arriving)] { deliver(arriving); });
    }
  }

  void rebind() {
    for (UdpSide& side : udp_sides) {
      for (auto& [from, client] : side.clients) {
        asio::error_code ignored;
        client->socket.close(ignored);
      }
      side.clients.clear();  // made again for the next datagram
    }
  }

  void accept(TcpSide& side) {
    auto link = std::make_shared<TcpLink>(io);
    side.acceptor.async_accept(link->ends[0], [this, &side, link](const asio::error_code& error) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        ++connections;
        links.remove_if([](const auto& l) { return l.expired(); });
        links.push_back(link);
        link->ends[1].async_connect(side.server, [this, link](const asio::error_code& failed) {
          if (failed) return close(*link, true);
          for (tcp::socket& end : link->ends) {
            asio::error_code ignored;
            end.set_option(tcp::no_delay(true), ignored);
          }
          read(link, 0);
          read(link, 1);
        });
      }
      accept(side);
    });
  }

  void read(const std::shared_ptr<TcpLink>& link, std::size_t d) {
    TcpLink::Direction& way = link->directions[d];
    if (!link->open || way.reading || way.ended || way.pending > kMostPendingBytes) return;
    way.reading = true;
    link->ends[d].async_read_some(
        asio::buffer(way.buffer), [this, link, d](const asio::error_code& error, std::size_t size) {
          TcpLink::Direction& from = link->directions[d];
          from.reading = false;
          if (!link->open) return;
          if (error && error != asio::error::eof) return close(*link, true);
          if (error) from.ended = true;
          arrive_later(link, d, error ? std::string() : std::string(from.buffer.data(), size));
          read(link, d);
        });
  }

  void arrive_later(const std::shared_ptr<TcpLink>& link, std::size_t d, std::string bytes) {
    TcpLink::Direction& way = link->directions[d];
    const Time now = later.now();
    const auto copies = tcp_fates[d].pass(now, bytes.size());
    Time at = copies.empty() ? now + quality().delay + kRetransmission : copies.front().at;
    if (now < partition_until) at = std::max(at, partition_until + quality().delay);
    way.last = at = std::max(at, way.last);
    way.pending += bytes.size();
    later.post(at, [this, link, d, bytes = std::move(bytes)]() mutable {
      link->directions[d].arrived.push_back(std::move(bytes));
      write(link, d);
    });
  }

  void write(const std::shared_ptr<TcpLink>& link, std::size_t d) {
    TcpLink::Direction& way = link->directions[d];
    if (!link->open || way.writing || way.arrived.empty()) return;
    tcp::socket& to = link->ends[1 - d];
    if (way.arrived.front().empty()) {
      asio::error_code ignored;
      to.shutdown(tcp::socket::shutdown_send, ignored);
      way.arrived.clear();
      if (link->directions[0].ended && link->directions[1].ended && link->directions[1 - d].pending == 0)
        close(*link, false);
      return;
    }
    way.writing = true;
    asio::async_write(to, asio::buffer(way.arrived.front()),
                      [this, link, d](const asio::error_code& error, std::size_t size) {
                        TcpLink::Direction& sent = link->directions[d];
                        sent.writing = false;
                        if (!link->open) return;
                        if (error) return close(*link, true);
                        sent.pending -= size;
                        sent.arrived.pop_front();
                        write(link, d);
                        read(link, d);
                      });
  }

  void close(TcpLink& link, bool reset) {
    link.open = false;
    for (tcp::socket& end : link.ends) {
      asio::error_code ignored;
      if (reset) end.set_option(asio::socket_base::linger(true, 0), ignored);
      end.close(ignored);
    }
  }

  void reset() {
    for (const auto& weak : links) {
      const auto link = weak.lock();
      if (!link || !link->open) continue;
      close(*link, true);
      ++resets;
    }
    links.clear();
  }

  std::string command(const std::string& line);

  void read_commands() {
    asio::async_read_until(input, lines, '\n', [this](const asio::error_code& error, std::size_t) {
      if (error) return;  // the input has ended; signals still work
      std::istream in(&lines);
      std::string line;
      std::getline(in, line);
      std::printf("%s\n", command(line).c_str());
      std::fflush(stdout);
      read_commands();
    });
  }

  void wait_for_signals() {
    signals.async_wait([this](const asio::error_code& error, int number) {
      if (error) return;
      if (number != SIGUSR1) return io.stop();
      partition_until = later.now() + kSignalPartition;
      wait_for_signals();
    });
  }
};

std::string Relay::Impl::command(const std::string& line) {
  std::istringstream in(line);
  std::string what;
  in >> what;
  PathQuality quality = this->quality();
  const auto number = [&](double most) -> std::optional<double> {
    double value = 0;
    return in >> value && value >= 0.0 && value <= most ? std::optional(value) : std::nullopt;
  };
  const auto in_ms = [](double ms) { return Time(static_cast<std::int64_t>(ms * 1e6)); };
  const std::map<std::string, double*> shares{
      {"loss", &quality.loss}, {"reorder", &quality.reorder}, {"duplicate", &quality.duplicate}};
  if (const auto share = shares.find(what); share != shares.end()) {
    const auto value = number(1.0);
    if (!value) return what + " needs a share from 0 to 1";
    *share->second = *value;
    set(quality);
  } else if (what == "partition") {
    const auto ms = number(1e7);
    if (!ms) return "partition needs its milliseconds";
    partition_until = later.now() + in_ms(*ms);
  } else if (what == "delay") {
    const auto ms = number(1e5);
    if (!ms) return "delay needs its milliseconds";
    quality.delay = in_ms(*ms);
    quality.jitter = in_ms(number(*ms).value_or(0.0));
    set(quality);
  } else if (what == "kbit") {
    const auto kbit = number(1e7);
    if (!kbit) return "kbit needs the kilobits a second, 0 for no limit";
    quality.bytes_per_s = *kbit * 1000.0 / 8.0;
    set(quality);
  } else if (what == "good") {
    set({});
    partition_until = {};
  } else if (what == "reset") {
    reset();
  } else if (what == "rebind") {
    rebind();
  } else if (what == "counts") {
    const ImpairmentCounts &up = fates[0].counts(), &down = fates[1].counts();
    std::ostringstream out;
    out << "ok udp " << up.given + down.given << ' ' << up.lost + down.lost << ' ' << up.duplicated + down.duplicated
        << ' ' << up.held_back + down.held_back << " tcp " << connections << ' ' << resets;
    return out.str();
  } else if (what == "quit") {
    io.stop();
  } else {
    return "no such command: " + what;
  }
  return "ok";
}

Relay::Relay(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Relay::~Relay() = default;

Result<std::unique_ptr<Relay>> Relay::open(const RelayOptions& options) {
  auto impl = std::make_unique<Impl>(options);
  struct Target {
    asio::ip::address address;
    std::uint16_t port = 0;
  };
  const auto target_of = [](const std::string& text) -> Result<Target> {
    const auto colon = text.rfind(':');
    asio::error_code error;
    const auto address = asio::ip::make_address(text.substr(0, colon), error);
    const int port = colon == std::string::npos ? 0 : std::atoi(text.c_str() + colon + 1);
    if (error || port <= 0 || port > 65535)
      return failure(ErrorCode::invalid_input, "\"" + text + "\" is no target; give a numeric ADDRESS:PORT");
    return Target{address, static_cast<std::uint16_t>(port)};
  };
  const asio::ip::address loopback = asio::ip::address_v4::loopback();
  for (const std::string& text : options.udp) {
    const auto target = target_of(text);
    if (!target) return tl::unexpected(target.error());
    asio::error_code error;
    impl->udp_sides.push_back({udp::socket(impl->io), {target->address, target->port}, {}, {}, {}});
    Impl::UdpSide& side = impl->udp_sides.back();
    side.socket.open(udp::v4(), error);
    if (!error) side.socket.bind({loopback, 0}, error);
    if (!error) side.socket.non_blocking(true, error);
    if (error) return failure(ErrorCode::unavailable, error_of("no UDP port to listen on", error));
    impl->receive(side);
  }
  for (const std::string& text : options.tcp) {
    const auto target = target_of(text);
    if (!target) return tl::unexpected(target.error());
    asio::error_code error;
    impl->tcp_sides.push_back({tcp::acceptor(impl->io), {target->address, target->port}});
    Impl::TcpSide& side = impl->tcp_sides.back();
    side.acceptor.open(tcp::v4(), error);
    if (!error) side.acceptor.bind({loopback, 0}, error);
    if (!error) side.acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) return failure(ErrorCode::unavailable, error_of("no TCP port to listen on", error));
    impl->accept(side);
  }
  return std::unique_ptr<Relay>(new Relay(std::move(impl)));
}

std::vector<std::string> Relay::addresses() const {
  std::vector<std::string> out;
  const auto add = [&](const char* kind, std::uint16_t port) {
    out.push_back(kind + (" 127.0.0.1:" + std::to_string(port)));
  };
  for (const auto& side : impl_->udp_sides) add("udp", side.socket.local_endpoint().port());
  for (const auto& side : impl_->tcp_sides) add("tcp", side.acceptor.local_endpoint().port());
  return out;
}

std::string Relay::command(const std::string& line) { return impl_->command(line); }

void Relay::run() {
  asio::error_code error;
  impl_->input.assign(::dup(STDIN_FILENO), error);
  if (!error) impl_->read_commands();  // a file cannot be waited for as a stream: then only signals work
  impl_->wait_for_signals();
  impl_->io.run();
}

}  // namespace osteon::test
