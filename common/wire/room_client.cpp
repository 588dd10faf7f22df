#include "common/wire/room_client.hpp"

#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/field/kernel.hpp"
#include "common/wire/connection_fault.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/host_port.hpp"
#include "osteon/v1/room.grpc.pb.h"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kMaxReceiveBytes = 4 * 1024 * 1024;  // a part of a case is 1 MiB, a mesh message about 256 kB
constexpr auto kAnswerTime = 5s;                   // for one request to a server that was reached
constexpr auto kAgainTime = 1s;                    // for one attempt to reconnect to a lost server
// For one attempt to connect: TCP, TLS and HTTP/2 take four round trips. gRPC calls this time a back-off.
constexpr int kConnectMs = 3000;
// A server that is silent for kPingMs gets a ping, and counts as lost if it does not answer in time. The server allows
// pings from kShortestPingMs on (server/rpc/room_server.cpp). A haptic client waits longer than its ConfirmationMonitor
// does, because its user can still feel its own replica of the bone.
constexpr int kPingMs = 2000, kPingAnswerMs = 3000, kHandsPingAnswerMs = 25'000;

// The room that calls on a channel go to. Empty: the only open room.
class RoomName {
 public:
  explicit RoomName(std::string name) : name_(std::move(name)) {}
  void set(const std::string& name) {
    const MutexLock lock(mutex_);
    name_ = name;
  }
  [[nodiscard]] std::string get() const {
    const MutexLock lock(mutex_);
    return name_;
  }

 private:
  mutable Mutex mutex_{LockRank::leaf};
  std::string name_ OSTEON_GUARDED_BY(mutex_);
};

// Adds the room's name and the ticket to every call of a channel.
class RoomNamer final : public grpc::experimental::Interceptor {
 public:
  RoomNamer(std::string room, std::string ticket) : room_(std::move(room)), ticket_(std::move(ticket)) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* call) override {
    if (call->QueryInterceptionHookPoint(grpc::experimental::InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      if (!room_.empty()) call->GetSendInitialMetadata()->insert({"osteon-room-bin", room_});
      if (!ticket_.empty()) call->GetSendInitialMetadata()->insert({"osteon-ticket", ticket_});
    }
    call->Proceed();
  }

 private:
  const std::string room_, ticket_;  // referenced by the call until it is over
};

class RoomNamers final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  RoomNamers(std::shared_ptr<const RoomName> room, ClientCredentials credentials)
      : room_(std::move(room)), credentials_(std::move(credentials)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo*) override {
    return new RoomNamer(room_ ? room_->get() : std::string(), ticket_text(credentials_));  // the call deletes it
  }

 private:
  const std::shared_ptr<const RoomName> room_;  // shared with whoever joined over this channel
  const ClientCredentials credentials_;
};

std::shared_ptr<grpc::Channel> make_channel(const std::string& address,
                                            const std::shared_ptr<grpc::ChannelCredentials>& security, ClientKind kind,
                                            const std::shared_ptr<const RoomName>& room,
                                            const ClientCredentials& credentials) {
  // The program reports failures in one sentence, so gRPC's own log lines are switched off.
  gpr_set_log_function([](gpr_log_func_args*) {});
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kind == ClientKind::haptic ? kHandsPingAnswerMs : kPingAnswerMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> namers;
  if (room || !credentials.ticket.empty()) namers.push_back(std::make_unique<RoomNamers>(room, credentials));
  return grpc::experimental::CreateCustomChannelWithInterceptors(address, security, arguments, std::move(namers));
}

bool is_server_address(const std::string& address) {
  const Result<HostPort> at = parse_host_port(address, "--server");
  return at && at->port > 0 && address.find('/') == std::string::npos;
}

Error error_of(const grpc::Status& status, const std::string& server) {
  if (std::optional<Error> http = error_of_http(status.error_message(), server)) return std::move(*http);
  switch (status.error_code()) {
    case grpc::StatusCode::FAILED_PRECONDITION:
      return {ErrorCode::unsupported, status.error_message()};
    case grpc::StatusCode::INVALID_ARGUMENT:
      return {ErrorCode::invalid_input, status.error_message()};
    case grpc::StatusCode::NOT_FOUND:
      return {ErrorCode::not_found, status.error_message()};
    case grpc::StatusCode::UNAUTHENTICATED:
    case grpc::StatusCode::PERMISSION_DENIED:
      return {ErrorCode::denied, "the server denies access: " + status.error_message()};
    case grpc::StatusCode::UNIMPLEMENTED:
      return {ErrorCode::unsupported, server + " is not an Osteon server of this version"};
    default:
      return {ErrorCode::unavailable, server + " does not answer: " + status.error_message()};
  }
}

Result<std::shared_ptr<grpc::Channel>> reach(const std::string& address, const std::shared_ptr<const RoomName>& room,
                                             ClientKind kind, ReachPatience patience, const std::function<bool()>& stop,
                                             const ClientCredentials& credentials) {
  if (!is_server_address(address))
    return failure(ErrorCode::invalid_input, "the server's address " + address +
                                                 " is not HOST:PORT; give the one that osteon-server prints, such as " +
                                                 "127.0.0.1:50151, without http:// and without a path");
  const Result<std::shared_ptr<grpc::ChannelCredentials>> security = channel_credentials(credentials, address);
  if (!security) return tl::unexpected(security.error());
  std::shared_ptr<grpc::Channel> channel = make_channel(address, *security, kind, room, credentials);
  // Waits in short intervals, so that the caller can stop.
  const auto begin = Clock::now();
  auto until = begin + patience.all;
  bool has_looked = false;
  while (!channel->WaitForConnected(std::chrono::system_clock::now() + 50ms)) {
    if (stop && stop()) return failure(ErrorCode::cancelled, "stopped before the server at " + address + " answered");
    const bool is_over = Clock::now() >= until;
    const bool has_failed = !has_looked && channel->GetState(false) == GRPC_CHANNEL_TRANSIENT_FAILURE;
    if (!is_over && !has_failed) continue;
    // At the first failure and at the end, so that nobody waits if waiting does not help.
    has_looked = true;
    ConnectionFault fault = connection_fault(address, credentials, stop);
    if (stop && stop()) continue;
    if (is_over || fault.lasts) return tl::unexpected(std::move(fault.error));
    if (fault.refused) until = std::min(until, begin + patience.refused);
  }
  return channel;
}

v1::JoinRequest request_of(ClientKind kind) {
  v1::JoinRequest request;
  request.set_protocol_version(kProtocolVersion);
  request.set_kernel_version(kind == ClientKind::haptic ? kKernelVersion : 0);
  request.set_kind(static_cast<v1::ClientKind>(kind));
  return request;
}

// Looks in short intervals whether the caller stops. Then the call is cancelled.
grpc::Status answer_of_join(const std::shared_ptr<grpc::Channel>& channel, const v1::JoinRequest& request,
                            grpc::ClientContext& context, v1::JoinResponse& response,
                            const std::function<bool()>& stop) {
  grpc::CompletionQueue queue;
  grpc::Status status;
  const auto stub = v1::RoomService::NewStub(channel);
  const auto call = stub->AsyncJoin(&context, request, &queue);
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool is_ok = false;
  while (queue.AsyncNext(&tag, &is_ok, std::chrono::system_clock::now() + 50ms) ==
         grpc::CompletionQueue::NextStatus::TIMEOUT)
    if (stop && stop()) context.TryCancel();
  queue.Shutdown();
  while (queue.Next(&tag, &is_ok)) {
  }
  return status;
}

// Joins over `room`'s channel. `server` is for messages.
Result<JoinedRoom> ask_to_join(JoinedRoom room, const v1::JoinRequest& request, const std::string& server,
                               grpc::ClientContext& context, const std::function<bool()>& stop = {}) {
  v1::JoinResponse response;
  const grpc::Status status = answer_of_join(room.channel, request, context, response, stop);
  if (!status.ok()) return tl::unexpected(error_of(status, server));

  const Result<Digest> hash = digest_from_wire(response.case_hash());
  if (!hash || response.author() == 0 || !(response.pitch_mm() > 0))
    return failure(ErrorCode::unsupported, server + " does not answer as an Osteon server does");
  room.author = AuthorId{response.author()};
  room.server_epoch = response.server_epoch();
  room.lease_epoch = response.lease_epoch();
  room.case_hash = *hash;
  room.case_title = response.case_title();
  room.pitch_mm = response.pitch_mm();
  room.bounds = {from_wire(response.bounds_min_mm()), from_wire(response.bounds_max_mm())};
  room.room_seq = RoomSeq{response.room_seq()};
  room.name = response.room();
  if (!response.secret().empty()) room.secret = response.secret();
  return room;
}

}  // namespace

std::optional<Error> error_of_http(const std::string& said, const std::string& server) {
  constexpr std::string_view kStatus = "http2 header with status: ";
  const std::size_t at = said.find(kStatus);
  if (at == std::string::npos) return {};
  const std::string status = said.substr(at + kStatus.size());
  if (status.starts_with("502") || status.starts_with("503") || status.starts_with("504"))
    return Error{ErrorCode::unavailable,
                 server + " is a proxy that reaches no Osteon server behind it (HTTP " + status +
                     "); see whether osteon-server runs there, with the proxy's --proxy-socket"};
  if (status.starts_with("413"))
    return Error{ErrorCode::exhausted, "a proxy before the server takes nothing as large (HTTP " + status +
                                           "); ask its operator for a higher limit"};
  return Error{ErrorCode::unsupported, server + " is no Osteon server, but another one (HTTP " + status +
                                           "); give with --server the port that osteon-server printed"};
}

Result<std::shared_ptr<grpc::Channel>> reach_server(const std::string& address, ClientKind kind, ReachPatience patience,
                                                    const std::function<bool()>& stop,
                                                    const ClientCredentials& credentials) {
  return reach(address, nullptr, kind, patience, stop, credentials);
}

Result<JoinedRoom> join_room(const std::string& address, ClientKind kind, const std::string& name,
                             ReachPatience patience, const std::function<bool()>& stop, const std::string& named,
                             const ClientCredentials& credentials) {
  const auto calls_to = std::make_shared<RoomName>(named);  // shared with the channel
  Result<std::shared_ptr<grpc::Channel>> channel = reach(address, calls_to, kind, patience, stop, credentials);
  if (!channel) return tl::unexpected(channel.error());
  JoinedRoom room;
  room.channel = std::move(*channel);
  v1::JoinRequest request = request_of(kind);
  request.set_name(name);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kAnswerTime);
  Result<JoinedRoom> joined = ask_to_join(std::move(room), request, "the program at " + address, context, stop);
  if (!joined && stop && stop())
    return failure(ErrorCode::cancelled, "stopped before the server at " + address + " answered");
  // More rooms may be opened later. Name this one in further calls.
  if (joined) calls_to->set(joined->name);
  return joined;
}

Result<JoinedRoom> join_again(const JoinedRoom& room, ClientKind kind, const std::optional<DurableSeq>& kept) {
  v1::JoinRequest request = request_of(kind);
  request.set_resume_author(room.author.value);
  request.set_secret(room.secret);
  if (kept) {
    request.set_durable_room_seq(kept->room_seq.value);
    request.set_durable_chain(to_wire(kept->chain));
    request.set_durable_seal(to_wire(kept->seal));
  }
  // Waits until the channel, which keeps trying, has a connection.
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  context.set_deadline(std::chrono::system_clock::now() + kAgainTime);
  Result<JoinedRoom> again = ask_to_join(room, request, "the server", context);
  if (again && (again->case_hash != room.case_hash || again->author != room.author))
    return failure(ErrorCode::unsupported, "another room answers where this one was");
  return again;
}

}  // namespace osteon::wire
