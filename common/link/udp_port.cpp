#include "common/link/udp_port.hpp"

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <asio/ip/v6_only.hpp>
#include <asio/post.hpp>

#include <array>

#include "common/core/check.hpp"

namespace osteon {
namespace {

using asio::ip::udp;

// Limits the attempts of receive() that return nothing, so that a flood of dropped datagrams does not block the caller.
constexpr int kMostTurns = 64;

Endpoint endpoint_of(const udp::endpoint& from) {
  const asio::ip::address address = from.address();
  const auto bytes =
      (address.is_v4() ? make_address_v6(asio::ip::v4_mapped, address.to_v4()) : address.to_v6()).to_bytes();
  Endpoint endpoint{0, 0, from.port()};
  for (std::size_t i = 0; i < 8; ++i) {
    endpoint.high = endpoint.high << 8 | bytes[i];
    endpoint.low = endpoint.low << 8 | bytes[i + 8];
  }
  return endpoint;
}

// The address as a socket of this family accepts it. Nothing if an IPv4 socket would have to reach IPv6.
std::optional<udp::endpoint> reached_by(bool is_v4, const Endpoint& to) {
  asio::ip::address_v6::bytes_type bytes;
  for (std::size_t i = 0; i < 8; ++i) {
    bytes[i] = static_cast<std::uint8_t>(to.high >> 8 * (7 - i));
    bytes[i + 8] = static_cast<std::uint8_t>(to.low >> 8 * (7 - i));
  }
  const asio::ip::address_v6 address(bytes);
  if (!is_v4) return udp::endpoint(address, to.port);
  if (!address.is_v4_mapped()) return {};
  return udp::endpoint(make_address_v4(asio::ip::v4_mapped, address), to.port);
}

}  // namespace

struct UdpPort::Socket {
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> never_done = make_work_guard(context);
  udp::socket datagrams{context};
  bool is_v4 = true;
  bool watched = false;            // `context` waits for the socket
  std::atomic<bool> woken{false};  // `context` has a wake() to run
};

UdpPort::UdpPort(std::unique_ptr<Socket> socket) : socket_(std::move(socket)) {}
UdpPort::~UdpPort() = default;  // closes the socket, and drops its waiting handlers without calling them

Result<std::unique_ptr<UdpPort>> UdpPort::open(const UdpPortOptions& options) {
  const std::string name = options.address + " port " + std::to_string(options.port);
  asio::error_code error;
  const asio::ip::address address = asio::ip::make_address(options.address, error);
  if (error)
    return failure(ErrorCode::invalid_input,
                   "\"" + options.address + "\" is no numeric address for UDP; give one such as 0.0.0.0");
  const auto refused = [&](const char* what) {
    return failure(ErrorCode::unavailable, std::string("UDP on ") + name + " cannot be " + what + " (" +
                                               error.message() + "); give an address of this machine and a free port");
  };
  auto socket = std::make_unique<Socket>();
  socket->is_v4 = address.is_v4();
  if (socket->datagrams.open(address.is_v4() ? udp::v4() : udp::v6(), error)) return refused("opened");
  if (address.is_v6() && address.is_unspecified() && socket->datagrams.set_option(asio::ip::v6_only(false), error))
    return refused("opened");
  if (socket->datagrams.bind({address, options.port}, error)) return refused("bound");
  if (socket->datagrams.non_blocking(true, error)) return refused("opened");
  // optional; an error does not matter
  socket->datagrams.set_option(asio::socket_base::receive_buffer_size(options.receive_buffer_bytes), error);
  return std::unique_ptr<UdpPort>(new UdpPort(std::move(socket)));
}

void UdpPort::send(const Endpoint& to, std::span<const std::uint8_t> bytes) {
  OSTEON_CHECK(bytes.size() <= kMostDatagramBytes);
  asio::error_code error = asio::error::network_unreachable;
  if (const auto reached = reached_by(socket_->is_v4, to))
    socket_->datagrams.send_to(asio::buffer(bytes.data(), bytes.size()), *reached, 0, error);
  ++(error ? send_failed_ : sent_);
}

std::optional<Datagram> UdpPort::receive(std::span<std::uint8_t> into) {
  OSTEON_CHECK(into.size() >= kMostDatagramBytes);
  // One byte more than allowed, because the system silently truncates longer datagrams.
  std::array<std::uint8_t, 1> beyond{};
  const std::array<asio::mutable_buffer, 2> buffers{asio::buffer(into.data(), kMostDatagramBytes),
                                                    asio::buffer(beyond)};
  for (int turn = 0; turn < kMostTurns; ++turn) {
    udp::endpoint from;
    asio::error_code error;
    const std::size_t size = socket_->datagrams.receive_from(buffers, from, 0, error);
    if (error == asio::error::would_block) return {};
    if (error) {
      ++receive_failed_;  // such as connection_refused: no program received what was sent before
    } else if (size > kMostDatagramBytes) {
      ++dropped_;
    } else {
      ++received_;
      return Datagram{endpoint_of(from), into.first(size)};
    }
  }
  return {};
}

Endpoint UdpPort::local() const {
  asio::error_code error;
  return endpoint_of(socket_->datagrams.local_endpoint(error));
}

bool UdpPort::wait(std::chrono::nanoseconds patience) {
  Socket* const socket = socket_.get();
  if (!socket->watched) {
    socket->watched = true;
    socket->datagrams.async_wait(udp::socket::wait_read,
                                 [socket](const asio::error_code&) { socket->watched = false; });
  }
  // run_one_for() does nothing if its time is zero.
  return (patience.count() > 0 ? socket->context.run_one_for(patience) : socket->context.poll_one()) > 0;
}

void UdpPort::wake() {
  Socket* const socket = socket_.get();
  if (!socket->woken.exchange(true)) asio::post(socket->context, [socket] { socket->woken = false; });
}

UdpPortCounts UdpPort::counts() const { return {sent_, send_failed_, received_, dropped_, receive_failed_}; }

Result<Endpoint> find_endpoint(const std::string& host, std::uint16_t port) {
  asio::io_context context;
  asio::error_code error;
  const asio::ip::address numeric = asio::ip::make_address(host, error);
  if (!error) return endpoint_of({numeric, port});
  const auto found = udp::resolver(context).resolve(host, std::to_string(port), udp::resolver::numeric_service, error);
  if (error || found.empty())
    return failure(ErrorCode::not_found,
                   "no machine named \"" + host + "\" is known (" + error.message() + "); give its address");
  for (const auto& entry : found)
    if (entry.endpoint().address().is_v4()) return endpoint_of(entry.endpoint());
  return endpoint_of(found.begin()->endpoint());
}

}  // namespace osteon
