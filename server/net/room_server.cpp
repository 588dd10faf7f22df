#include "server/net/room_server.hpp"

#include <grpc/support/log.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/impl/service_type.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <system_error>
#include <utility>

#include "common/core/check.hpp"
#include "server/net/health_watch.hpp"
#include "common/runtime/log.hpp"
#include "server/net/link_server.hpp"
#include "server/net/services.hpp"

namespace osteon {
namespace {

struct HostPort {
  std::string host;
  int port = 0;
};

Result<HostPort> parse_listen(const std::string& listen) {
  const std::size_t colon = listen.rfind(':');
  HostPort out;
  if (colon != std::string::npos) {
    out.host = listen.substr(0, colon);
    const char *first = listen.data() + colon + 1, *last = listen.data() + listen.size();
    const auto [end, error] = std::from_chars(first, last, out.port);
    if (error == std::errc{} && end == last && out.port >= 0 && out.port <= 65535 && !out.host.empty()) return out;
  }
  return failure(ErrorCode::invalid_input, "--listen " + listen + " is not HOST:PORT with a port from 0 to 65535");
}

// Four numbers that begin with 127: a name or a longer text is not taken for an address.
bool is_ipv4_loopback(const std::string& host) {
  int parts[4] = {};
  const char *at = host.data(), *last = at + host.size();
  for (int i = 0; i < 4; ++i) {
    const auto [end, error] = std::from_chars(at, last, parts[i]);
    if (error != std::errc{} || parts[i] < 0 || parts[i] > 255) return false;
    at = end;
    if (i < 3 && (at == last || *at++ != '.')) return false;
  }
  return at == last && parts[0] == 127;
}

bool is_loopback(const std::string& host) { return host == "localhost" || host == "[::1]" || is_ipv4_loopback(host); }

Error cannot_listen(const std::string& listen, const std::string& why, ErrorCode code = ErrorCode::unavailable) {
  return {code, "cannot listen on " + listen + ": " + why + "; choose another with --listen, or 0 for a free one"};
}
Error cannot_listen(const std::string& listen, int reason) {
  if (reason == EADDRINUSE) return cannot_listen(listen, "the port is in use by another program", ErrorCode::exists);
  return cannot_listen(listen, std::generic_category().message(reason));
}

// Binds a socket there and closes it again. 0, or why the system refuses.
int try_to_bind(const addrinfo& address) {
  const int socket = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
  if (socket < 0) return errno;
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const int reason = ::bind(socket, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  ::close(socket);
  return reason;
}

Result<void> try_to_listen(const std::string& listen, const HostPort& at) {
  const std::string host = at.host == "[::1]" ? "::1" : at.host;
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (const int unknown = ::getaddrinfo(host.c_str(), std::to_string(at.port).c_str(), &hints, &found); unknown != 0)
    return tl::unexpected(cannot_listen(listen, ::gai_strerror(unknown)));
  bool bound = false;
  int lacking = 0, refused = 0;
  for (const addrinfo* address = found; address; address = address->ai_next) {
    const int reason = try_to_bind(*address);
    // localhost has an address of each family, and a machine may lack one of them.
    if (reason == EADDRNOTAVAIL || reason == EAFNOSUPPORT)
      lacking = reason;
    else if (reason != 0)
      refused = reason;
    else
      bound = true;
  }
  ::freeaddrinfo(found);
  if (refused != 0) return tl::unexpected(cannot_listen(listen, refused));
  if (!bound) return tl::unexpected(cannot_listen(listen, lacking));
  return {};
}

// Where datagrams are heard: the numeric address of `host`.
std::string numeric(const std::string& host) {
  if (host == "localhost") return "127.0.0.1";
  return host == "[::1]" ? "::1" : host;
}

constexpr int kMaxReceiveBytes = 4 * 1024 * 1024;  // a cut of 64 knots is below 4 kB, a tool made from a mesh a few MB
constexpr int kMaxSendBytes = 4 * 1024 * 1024;     // a piece of a case is 1 MiB
constexpr int kKeepaliveMs = 10'000;               // a peer that answers no ping that long is gone
constexpr int kShortestPingMs = 500;               // clients may ask that often whether the server lives
constexpr const char* kStopping = "the server is stopping; come again in a few seconds";
constexpr std::chrono::milliseconds kComeAgainAfter{1000}, kDrainLook{20};

}  // namespace

struct RoomServer::Impl {
  std::unique_ptr<Rooms> rooms;
  std::unique_ptr<LinkServer> links;   // outlives the streams
  std::vector<std::unique_ptr<grpc::Service>> services;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<HealthWatch> health;  // of the server
  std::string address;
};

RoomServer::RoomServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RoomServer::~RoomServer() {
  if (impl_->server) (void)stop_all();
}

Result<void> RoomServer::check_listen(const std::string& listen) {
  const Result<HostPort> at = parse_listen(listen);
  if (!at) return tl::unexpected(at.error());
  if (!is_loopback(at->host))
    return failure(ErrorCode::invalid_input, "--listen " + listen +
                                                 " is reachable from other machines, but this server speaks plain text; "
                                                 "use 127.0.0.1, [::1] or localhost");
  return try_to_listen(listen, *at);
}

Result<std::unique_ptr<RoomServer>> RoomServer::start(Room room, const RoomServerOptions& options,
                                                      const std::function<void(double)>& progress,
                                                      std::unique_ptr<RoomKeeper> keeper) {
  if (Result<void> usable = check_listen(options.listen); !usable) return tl::unexpected(usable.error());
  RoomsOptions of_one{.cases = {{room.bone(), options.case_folder}}, .rates = options.rates, .detail = options.detail};
  auto rooms = std::make_unique<Rooms>(std::move(of_one));
  const std::string name = keeper ? keeper->genesis().room : "room";
  if (const auto added = rooms->add(name, std::move(room), std::move(keeper), options.save, progress); !added)
    return tl::unexpected(added.error());
  return start(std::move(rooms), options.listen);
}

Result<std::unique_ptr<RoomServer>> RoomServer::start(std::unique_ptr<Rooms> rooms, const std::string& listen) {
  if (Result<void> usable = check_listen(listen); !usable) return tl::unexpected(usable.error());
  // What fails is told in one sentence by the caller, not in gRPC's own lines.
  gpr_set_log_function([](gpr_log_func_args*) {});

  auto impl = std::make_unique<Impl>();
  impl->rooms = std::move(rooms);
  // Beside the streams; without it all goes over them.
  if (Result<std::unique_ptr<LinkServer>> links = LinkServer::open(numeric(parse_listen(listen)->host)); links)
    impl->links = std::move(*links);
  else
    log::warn("no fast path", {{"reason", links.error().message}});
  impl->services.push_back(make_room_service(*impl->rooms));
  impl->services.push_back(make_cutting_service(*impl->rooms, impl->links.get()));
  impl->services.push_back(make_watch_service(*impl->rooms));
  impl->services.push_back(make_rooms_service(*impl->rooms));

  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(listen, grpc::InsecureServerCredentials(), &port);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kShortestPingMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 64);
  builder.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  builder.SetMaxSendMessageSize(kMaxSendBytes);
  for (const auto& service : impl->services) builder.RegisterService(service.get());
  impl->server = builder.BuildAndStart();
  if (!impl->server || port == 0) {
    // gRPC does not say why; most likely the port was taken while the surface was made.
    if (Result<void> usable = check_listen(listen); !usable) return tl::unexpected(usable.error());
    return tl::unexpected(cannot_listen(listen, "the system refused"));
  }
  impl->health = std::make_unique<HealthWatch>(*impl->rooms, *impl->server->GetHealthCheckService());
  impl->address = parse_listen(listen)->host + ":" + std::to_string(port);
  return std::unique_ptr<RoomServer>(new RoomServer(std::move(impl)));
}

const std::string& RoomServer::address() const { return impl_->address; }
Rooms& RoomServer::rooms() { return *impl_->rooms; }
HostHealth RoomServer::health() const {
  const Result<std::shared_ptr<OpenRoom>> room = impl_->rooms->find("");
  return room ? (*room)->host().health() : HostHealth{};
}
std::uint16_t RoomServer::link_port() const { return impl_->links ? impl_->links->port() : 0; }
LinkServerHealth RoomServer::link_health() const { return impl_->links ? impl_->links->health() : LinkServerHealth{}; }

void RoomServer::drain(std::chrono::milliseconds most, const std::function<bool(std::chrono::milliseconds)>& give_up) {
  impl_->rooms->begin_drain(kComeAgainAfter, kStopping);
  impl_->health->look();
  const auto sessions = [&] {
    std::size_t open = 0;
    for (const std::shared_ptr<OpenRoom>& room : impl_->rooms->open_rooms()) open += room->host().health().sessions;
    return open;
  };
  const auto until = std::chrono::steady_clock::now() + most;
  log::info("draining", {{"sessions", sessions()}, {"most_ms", most.count()}});
  while (sessions() > 0 && std::chrono::steady_clock::now() < until)
    if (give_up(kDrainLook)) break;
  log::info("drained", {{"sessions_left", sessions()}});
}

std::map<std::string, RoomSummary> RoomServer::stop_all() {
  impl_->rooms->begin_end();
  // Streams hear why first; those whose reader does not read are cut off after a moment.
  for (const std::shared_ptr<OpenRoom>& room : impl_->rooms->open_rooms())
    impl_->rooms->draining() ? room->send_away(kStopping) : room->end_streams("the server stops");
  impl_->health.reset();
  impl_->server->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  impl_->server->Wait();
  std::map<std::string, RoomSummary> summaries = impl_->rooms->close_all();
  impl_->rooms->jobs.stop();
  impl_->rooms->files.stop();
  impl_->server.reset();
  return summaries;
}

RoomSummary RoomServer::stop() {
  std::map<std::string, RoomSummary> all = stop_all();
  OSTEON_CHECK(all.size() == 1);
  return std::move(all.begin()->second);
}

}  // namespace osteon
