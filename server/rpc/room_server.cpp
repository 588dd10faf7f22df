#include "server/rpc/room_server.hpp"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/impl/service_type.h>

#include <chrono>
#include <utility>

#include "common/core/check.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/host_port.hpp"
#include "server/auth/authorizer.hpp"
#include "server/auth/cipher_order.hpp"
#include "server/auth/server_certificate.hpp"
#include "server/rpc/audited_calls.hpp"
#include "server/rpc/call_flood.hpp"
#include "server/rpc/health_watch.hpp"
#include "server/rpc/link_server.hpp"
#include "server/rpc/listener.hpp"
#include "server/rpc/refused_calls.hpp"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

Error cannot_listen(const std::string& listen, const std::string& why, ErrorCode code = ErrorCode::unavailable) {
  return {code, "cannot listen on " + listen + ": " + why + "; choose another with --listen, or 0 for a free one"};
}

Result<std::unique_ptr<Listener>> listen_on(const std::string& listen, const ConnectionOptions& connections) {
  const Result<HostPort> at = parse_host_port(listen, "--listen");
  if (!at) return tl::unexpected(at.error());
  if (connections.certificates.empty() && !is_loopback(at->host))
    return failure(ErrorCode::invalid_input,
                   "--listen " + listen +
                       " is reachable from other machines, but this server speaks plain text; "
                       "use 127.0.0.1, [::1] or localhost, or give --certificates DIR");
  Result<std::unique_ptr<Listener>> listener = Listener::open(at->host, at->port, connections.most_connections);
  if (!listener) return tl::unexpected(cannot_listen(listen, listener.error().message, listener.error().code));
  return listener;
}

// Opens the fast path at `connections.udp_listen`, or at a free port of the host of `address`. In the second case a
// failure is no error, since the streams carry everything.
Result<std::unique_ptr<LinkServer>> open_fast_path(const ConnectionOptions& connections, const std::string& address) {
  if (connections.udp_listen.empty()) {
    Result<std::unique_ptr<LinkServer>> links = LinkServer::open(address);
    if (links) return links;
    log::warn("no fast path", {{"reason", links.error().message}});
    return nullptr;
  }
  const Result<HostPort> at = parse_host_port(connections.udp_listen, "--udp-listen");
  if (!at) return tl::unexpected(at.error());
  if (connections.certificates.empty() && !is_loopback(at->host))
    return failure(ErrorCode::invalid_input, "--udp-listen " + connections.udp_listen +
                                                 " is reachable from other machines, but this server speaks plain "
                                                 "text; use 127.0.0.1 or [::1], or give --certificates DIR");
  std::string host = at->host;
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return LinkServer::open(host, static_cast<std::uint16_t>(at->port)).map_error([&](const Error& error) {
    return Error{error.code, "--udp-listen " + connections.udp_listen + ": " + error.message};
  });
}

constexpr int kMaxReceiveBytes = 4 * 1024 * 1024;  // a cut of 64 knots is below 4 kB, a tool made from a mesh a few MB
constexpr int kMaxSendBytes = 4 * 1024 * 1024;     // a part of a case is 1 MiB
constexpr int kShortestPingMs = 500;               // clients may ping the server this often
constexpr int kMostStreams = 64;                   // of one connection
constexpr int kMostMetadataBytes = 8 * 1024;       // of one call; a ticket is below 1 kB
// Calls that are begun and reset are bounded after each read (call_flood.hpp). A read of gRPC's default 4 MiB has
// 20 000 of them.
constexpr int kMostReadBytes = 16 * 1024;
constexpr int kHandshakeMs = 5'000;                                  // limit of the handshake
constexpr std::size_t kMostTransportBytes = std::size_t{512} << 20;  // of all connections, in gRPC
constexpr const char* kStopping = "the server is stopping; connect again in a few seconds";
constexpr std::chrono::milliseconds kComeAgainAfter{1000}, kDrainLook{5};

}  // namespace

struct RoomServer::Impl {
  std::unique_ptr<Rooms> rooms;
  std::unique_ptr<HandshakeWatch> handshakes;
  std::unique_ptr<Listener> listener;  // hands connections to the acceptor; its table of them outlives the authorizer
  std::unique_ptr<Listener> proxy_listener;  // null: there is no proxy
  std::unique_ptr<CallFlood> flood;          // null: plain text
  std::unique_ptr<Authorizer> authorizer;    // null: plain text; outlives the streams
  std::unique_ptr<LinkServer> links;         // outlives the streams
  std::vector<std::unique_ptr<grpc::Service>> services;
  std::unique_ptr<grpc::CallbackGenericService> unknown_calls;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor, proxy_acceptor;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<HealthWatch> health;  // of the server
  std::string address;
};

RoomServer::RoomServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RoomServer::~RoomServer() {
  if (impl_->server) (void)stop_all();
}

Result<void> RoomServer::check_listen(const std::string& listen, const ConnectionOptions& connections) {
  const Result<std::unique_ptr<Listener>> listener = listen_on(listen, connections);
  if (!listener) return tl::unexpected(listener.error());
  if (connections.udp_listen.empty()) return {};
  const Result<std::unique_ptr<LinkServer>> links = open_fast_path(connections, (*listener)->address());
  if (!links) return tl::unexpected(links.error());
  return {};
}

Result<std::unique_ptr<RoomServer>> RoomServer::start(Room room, const RoomServerOptions& options,
                                                      const std::function<void(double)>& progress,
                                                      std::unique_ptr<RoomStore> store) {
  if (Result<void> usable = check_listen(options.listen); !usable) return tl::unexpected(usable.error());
  RoomsOptions of_one{.cases = {{room.bone(), options.case_folder}}, .rates = options.rates, .detail = options.detail};
  auto rooms = std::make_unique<Rooms>(std::move(of_one));
  const std::string name = store ? store->genesis().room : "room";
  if (const auto added = rooms->add(name, std::move(room), std::move(store), options.save, progress); !added)
    return tl::unexpected(added.error());
  return start(std::move(rooms), options.listen);
}

Result<std::unique_ptr<RoomServer>> RoomServer::start(std::unique_ptr<Rooms> rooms, const std::string& listen,
                                                      const ConnectionOptions& connections) {
  Result<std::unique_ptr<Listener>> listener = listen_on(listen, connections);
  if (!listener) return tl::unexpected(listener.error());
  auto impl = std::make_unique<Impl>();
  impl->rooms = std::move(rooms);
  // The caller reports a failure in one sentence. gRPC's own log lines are not shown.
  impl->listener = std::move(*listener);
  impl->handshakes = std::make_unique<HandshakeWatch>(impl->rooms->refusals, impl->listener->connections());
  std::shared_ptr<grpc::ServerCredentials> credentials = grpc::InsecureServerCredentials();  // shared with gRPC
  if (!connections.certificates.empty()) {
    if (Result<void> preferred = prefer_own_cipher_order(); !preferred) return tl::unexpected(preferred.error());
    Result<std::unique_ptr<Authorizer>> authorizer = Authorizer::open(connections.certificates, impl->rooms->refusals);
    if (!authorizer) return tl::unexpected(authorizer.error());
    log_server_certificate(connections.certificates / "server.pem",
                           std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()));
    impl->authorizer = std::move(*authorizer);
    impl->rooms->authorizer = impl->authorizer.get();
    impl->authorizer->set_most_ticket_life(connections.most_ticket_life);
    impl->authorizer->set_connections(impl->listener->connections());
    if (impl->rooms->trail()) impl->authorizer->set_trail(*impl->rooms->trail());
    impl->authorizer->set_only_room([all = impl->rooms.get()] {
      const Result<std::shared_ptr<OpenRoom>> only = all->find("");
      return only ? (*only)->name : std::string();
    });
    credentials = impl->authorizer->credentials();
  }
  if (!connections.proxy_socket.empty()) {
    if (!impl->authorizer)
      return failure(ErrorCode::invalid_input,
                     "--proxy-socket needs --certificates DIR: a proxy passes on calls of people");
    Result<std::unique_ptr<Listener>> proxy = Listener::open_at(connections.proxy_socket, connections.most_connections);
    if (!proxy)
      return failure(proxy.error().code, "cannot listen at --proxy-socket " + connections.proxy_socket.string() + ": " +
                                             proxy.error().message + "; choose another path");
    impl->proxy_listener = std::move(*proxy);
  }
  // Beside the streams. Without it, everything goes over them.
  Result<std::unique_ptr<LinkServer>> links = open_fast_path(connections, impl->listener->address());
  if (!links) return tl::unexpected(links.error());
  impl->links = std::move(*links);
  impl->services.push_back(make_room_service(*impl->rooms));
  impl->services.push_back(make_cutting_service(*impl->rooms, impl->links.get()));
  impl->services.push_back(make_watch_service(*impl->rooms));
  impl->services.push_back(make_field_service(*impl->rooms));
  impl->services.push_back(make_people_service(*impl->rooms));
  impl->services.push_back(make_plan_service(*impl->rooms));
  impl->services.push_back(make_room_admin_service(*impl->rooms));
  impl->services.push_back(make_case_service(*impl->rooms));

  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  // The listener accepts and counts connections; then gRPC takes them over.
  impl->acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
  if (impl->proxy_listener)
    impl->proxy_acceptor = builder.experimental().AddExternalConnectionAcceptor(
        grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, grpc::InsecureServerCredentials());
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, static_cast<int>(connections.keepalive.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, static_cast<int>(connections.keepalive.count()));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kShortestPingMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMostReadBytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMostStreams);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kMostMetadataBytes);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, static_cast<int>(connections.connection_age.count()));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS,
                             static_cast<int>(connections.longest_session.count()));
  grpc::ResourceQuota quota("osteon");
  quota.Resize(kMostTransportBytes);
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  builder.SetMaxSendMessageSize(kMaxSendBytes);
  auto interceptors = refused_call_notes(impl->rooms->refusals);
  if (impl->authorizer) {
    impl->flood = std::make_unique<CallFlood>(connections.flood);
    interceptors.push_back(flood_watch(
        *impl->flood, [authorizer = impl->authorizer.get()](const PeerClaims& peer) { authorizer->note_flood(peer); }));
  }
  if (impl->rooms->trail()) {
    impl->handshakes->set_trail(*impl->rooms->trail());
    interceptors.push_back(audited_calls(*impl->rooms->trail(), impl->authorizer.get()));
  }
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  // Calls that no service has are authorized, counted and bounded like all others.
  impl->unknown_calls = make_unknown_calls(*impl->rooms);
  builder.RegisterCallbackGenericService(impl->unknown_calls.get());
  for (const auto& service : impl->services) builder.RegisterService(service.get());
  impl->server = builder.BuildAndStart();
  if (!impl->server) return tl::unexpected(cannot_listen(listen, "gRPC refused"));
  const auto hand_to = [](grpc::experimental::ExternalConnectionAcceptor* acceptor) {
    return [acceptor](int listening, int descriptor) {
      grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
      connection.listener_fd = listening;
      connection.fd = descriptor;
      acceptor->HandleNewConnection(&connection);
    };
  };
  if (!impl->authorizer)
    impl->listener->watch_for_tls([watch = impl->handshakes.get()] {
      watch->note("an unauthenticated client: TLS",
                  "it speaks TLS, and this server plain text; give the server --certificates DIR, or "
                  "the client --plain");
    });
  impl->listener->start(hand_to(impl->acceptor.get()));
  if (impl->proxy_listener) impl->proxy_listener->start(hand_to(impl->proxy_acceptor.get()));
  impl->health =
      std::make_unique<HealthWatch>(*impl->rooms, *impl->server->GetHealthCheckService(),
                                    impl->authorizer ? HealthWatch::Of::server : HealthWatch::Of::server_and_rooms);
  impl->address = parse_host_port(listen, "--listen")->host + ":" + std::to_string(impl->listener->port());
  return std::unique_ptr<RoomServer>(new RoomServer(std::move(impl)));
}

const std::string& RoomServer::address() const { return impl_->address; }
Rooms& RoomServer::rooms() { return *impl_->rooms; }
RuntimeHealth RoomServer::health() const {
  const Result<std::shared_ptr<OpenRoom>> room = impl_->rooms->find("");
  return room ? (*room)->runtime().health() : RuntimeHealth{};
}
std::uint16_t RoomServer::link_port() const { return impl_->links ? impl_->links->port() : 0; }
ConnectionHealth RoomServer::connection_health() const {
  return {impl_->listener->counts(), impl_->authorizer ? impl_->authorizer->counts() : AuthorizerCounts{}};
}
LinkServerHealth RoomServer::link_health() const { return impl_->links ? impl_->links->health() : LinkServerHealth{}; }

void RoomServer::drain(std::chrono::milliseconds most, const std::function<bool(std::chrono::milliseconds)>& give_up) {
  const auto sessions = [&] {
    std::size_t open = 0;
    for (const std::shared_ptr<OpenRoom>& room : impl_->rooms->open_rooms()) open += room->runtime().health().sessions;
    return open;
  };
  const auto until = std::chrono::steady_clock::now() + most;
  log::info("draining", {{"sessions", sessions()}, {"most_ms", most.count()}});
  impl_->rooms->begin_drain(kComeAgainAfter, kStopping);
  impl_->health->look();
  while (sessions() > 0 && std::chrono::steady_clock::now() < until)
    if (give_up(kDrainLook)) break;
  log::info("drained", {{"sessions_left", sessions()}});
}

std::map<std::string, RoomSummary> RoomServer::stop_all() {
  impl_->rooms->begin_end();
  // Streams are first sent the reason. Streams whose reader does not read are cut off after a moment.
  for (const std::shared_ptr<OpenRoom>& room : impl_->rooms->open_rooms())
    impl_->rooms->draining() ? room->send_away(kStopping) : room->end_streams("the server stops");
  impl_->health.reset();
  impl_->listener->stop();
  impl_->server->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  impl_->server->Wait();
  std::map<std::string, RoomSummary> summaries = impl_->rooms->close_all();
  impl_->rooms->end_calls();
  impl_->server.reset();
  return summaries;
}

RoomSummary RoomServer::stop() {
  std::map<std::string, RoomSummary> all = stop_all();
  OSTEON_CHECK(all.size() == 1);
  return std::move(all.begin()->second);
}

}  // namespace osteon
