// Which room a call is to. For the sources of the services alone: gRPC stays out of headers.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/access/role_table.hpp"
#include "common/core/check.hpp"
#include "common/runtime/log.hpp"
#include "server/net/gate.hpp"
#include "server/net/out_stream.inl"
#include "server/net/peer_claims.hpp"
#include "server/net/refused_calls.hpp"
#include "server/net/rooms.hpp"

namespace osteon {

// A header that comes once or not at all; nothing where it came twice: two readers might take different ones.
inline std::optional<std::string> metadata_of(const grpc::CallbackServerContext& context, const char* key) {
  const auto [first, last] = context.client_metadata().equal_range(key);
  if (first == last) return std::string();
  if (std::next(first) != last) return {};
  return std::string(first->second.data(), first->second.size());
}

// The headers that a call may have beside those of HTTP/2 and gRPC, which gRPC keeps to itself.
inline bool is_known_header(std::string_view name, bool by_proxy) {
  static constexpr std::array<std::string_view, 6> kKnown{"osteon-ticket",        "osteon-room-bin", "user-agent",
                                                          "grpc-accept-encoding", "accept-encoding", "grpc-trace-bin"};
  if (by_proxy && (name == kCertificateHeader || name == kAddressHeader)) return true;
  return std::ranges::find(kKnown, name) != kKnown.end();
}

inline tl::expected<Caller, Refusal> judged(Gate& gate, const grpc::CallbackServerContext& context, const std::string& room,
                                            std::string_view method) {
  const PeerClaims peer = peer_claims(context);
  const std::string ticket = metadata_of(context, "osteon-ticket").value_or("");
  return gate.judge({.peer = peer, .ticket = ticket, .room = room, .method = method});
}

// Authorizes a call at its beginning: certificate, ticket, role, headers and how often. Null: it may go on. The one
// place where calls are counted as admitted or refused; every handler begins with it. `about`: the room that the
// message names, for a ticket of every room.
inline std::optional<Status> refusal_of(const Rooms& rooms, grpc::CallbackServerContext& context,
                                        std::string_view method, std::string_view about = {}) {
  if (!rooms.gate) return {};
  const PeerClaims peer = peer_claims(context);
  const std::optional<std::string> room = metadata_of(context, "osteon-room-bin"),
                                   ticket = metadata_of(context, "osteon-ticket");
  const CallClaims call{.peer = peer,
                        .ticket = ticket ? std::string_view(*ticket) : std::string_view(),
                        .room = room ? std::string_view(*room) : std::string_view(),
                        .method = method,
                        .about = about};
  // Tells programs the reason, and refused_call_notes() that it was noted.
  const auto tell = [&](std::string_view reason) {
    context.AddTrailingMetadata(kRefusalTrailer, std::string(reason));
  };
  const auto wrong = [&](const std::string& sentence) {
    tell("request");
    rooms.gate->note_refused("request", sentence, call);
    return Status(StatusCode::INVALID_ARGUMENT, short_words(sentence));
  };
  for (const auto& [key, value] : context.client_metadata())
    if (!is_known_header({key.data(), key.size()}, peer.by_proxy))
      return wrong("the call has a header that this server does not know; leave out " + std::string(key.data(), key.size()));
  if (!room || !ticket) return wrong("the call says twice which ticket or room is meant");
  const auto caller = rooms.gate->admit(call);
  if (caller) return {};
  tell(caller.error().reason);
  return status_of(caller.error());
}

// The call that a request is of: of v1::UndoRequest "/osteon.v1.RoomService/Undo". The names of requests follow those
// of their calls, and a test holds the protocol to it.
template <class Request>
std::string_view method_of() {
  static const CallRow* const row = [] {
    const std::string_view request = Request::descriptor()->name();
    const std::string end = "/" + std::string(request.substr(0, request.size() - std::string_view("Request").size()));
    const auto found = std::ranges::find_if(call_rows(), [&](const CallRow& one) { return one.method.ends_with(end); });
    OSTEON_CHECK(found != call_rows().end());
    return &*found;
  }();
  return row->method;
}

// The same for the call of that request.
template <class Request>
std::optional<Status> refusal_of(const Rooms& rooms, grpc::CallbackServerContext& context) {
  return refusal_of(rooms, context, method_of<Request>());
}

// The same of a call that has one answer. False: it was answered with the refusal.
template <class Request>
bool admitted(const Rooms& rooms, grpc::CallbackServerContext& context, grpc::ServerUnaryReactor* reactor) {
  std::optional<Status> refusal = refusal_of<Request>(rooms, context);
  if (refusal) reactor->Finish(std::move(*refusal));
  return !refusal;
}

// Who calls. Over plain text nobody says so: `user` is empty then, and the caller may do anything. Error denied: the caller's
// right has ended since the call was let in.
inline Result<Caller> caller_of(const Rooms& rooms, const grpc::CallbackServerContext& context) {
  if (!rooms.gate) return Caller{};
  auto caller = judged(*rooms.gate, context, metadata_of(context, "osteon-room-bin").value_or(""), {});
  if (!caller) return failure(ErrorCode::denied, caller.error().sentence);
  return std::move(*caller);
}

// The same, as whoever they are in `room`, which has a name: of a call whose message names rooms. They need not be the metadata's,
// by which it was let in. Error denied: the ticket is not for that room, or the role there may not make the call `method`.
inline Result<Caller> caller_in(const Rooms& rooms, const grpc::CallbackServerContext& context, const std::string& room,
                                std::string_view method) {
  if (!rooms.gate) return Caller{};
  auto caller = judged(*rooms.gate, context, room, method);
  if (!caller) return failure(ErrorCode::denied, "not in room " + room + ": " + caller.error().sentence);
  return std::move(*caller);
}

// By the call's metadata "osteon-room-bin"; without it, the one that the ticket is for, or the only one that is open.
inline Result<std::shared_ptr<OpenRoom>> called_room(const Rooms& rooms, const grpc::CallbackServerContext& context) {
  const Result<Caller> caller = caller_of(rooms, context);
  if (!caller) return tl::unexpected(caller.error());
  std::string named = metadata_of(context, "osteon-room-bin").value_or("");
  if (named.empty() && caller->ticket_room != kAnyRoom) named = caller->ticket_room;
  return rooms.find(named);
}

// The same, of a call that is made as `author`. Error denied: that is not who calls.
inline Result<std::shared_ptr<OpenRoom>> called_room(const Rooms& rooms, const grpc::CallbackServerContext& context, AuthorId author) {
  Result<std::shared_ptr<OpenRoom>> room = called_room(rooms, context);
  if (!room || !rooms.gate) return room;
  const Result<Caller> caller = caller_of(rooms, context);
  if (!caller) return tl::unexpected(caller.error());
  if (const Result<void> own = rooms.gate->check_author(*caller, (*room)->name, author); !own) return tl::unexpected(own.error());
  return room;
}

// The log keeps the paths.
inline Status status_of(const Error& error) {
  if (without_paths(error.message) != error.message) log_failed_call(error.message);
  const std::string said = short_words(error.message);
  switch (error.code) {
    case ErrorCode::invalid_input: return invalid(said);
    case ErrorCode::not_found: return {StatusCode::NOT_FOUND, said};
    case ErrorCode::denied: return {StatusCode::PERMISSION_DENIED, said};
    case ErrorCode::exhausted: return {StatusCode::RESOURCE_EXHAUSTED, said};
    case ErrorCode::exists: return {StatusCode::ALREADY_EXISTS, said};
    case ErrorCode::unavailable:
    case ErrorCode::unsupported: return {StatusCode::FAILED_PRECONDITION, said};
    default: return {StatusCode::INTERNAL, said};
  }
}

// Answers a call that is not carried out.
inline grpc::ServerUnaryReactor* refuse(grpc::ServerUnaryReactor* reactor, Status status) {
  reactor->Finish(std::move(status));
  return reactor;
}

// The room of a call that has one answer; null once `reactor` was told why there is none.
inline std::shared_ptr<OpenRoom> room_of(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                         grpc::ServerUnaryReactor* reactor) {
  Result<std::shared_ptr<OpenRoom>> room = called_room(rooms, context);
  if (room) return std::move(*room);
  refuse(reactor, status_of(room.error()));
  return nullptr;
}

// The same, of one that is made as `author`, whether they have joined it or not.
inline std::shared_ptr<OpenRoom> room_of(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                         grpc::ServerUnaryReactor* reactor, AuthorId author) {
  Result<std::shared_ptr<OpenRoom>> room = called_room(rooms, context, author);
  if (room) return std::move(*room);
  refuse(reactor, status_of(room.error()));
  return nullptr;
}

// The same, of a request whose author has joined it.
template <class Request>
std::shared_ptr<OpenRoom> room_of_member(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                         grpc::ServerUnaryReactor* reactor, const Request& request) {
  const AuthorId author{request.author()};
  std::shared_ptr<OpenRoom> room = room_of(rooms, context, reactor, author);
  if (!room || room->host().knows(author)) return room;
  refuse(reactor, not_joined(std::string(Request::descriptor()->name()).c_str(), author.value));
  return nullptr;
}

// An event of the room; the call is answered when every session has been told, by what `fill` makes of it.
template <class Fill>
grpc::ServerUnaryReactor* change_room(OpenRoom& room, grpc::ServerUnaryReactor* reactor,
                                      std::function<Result<RoomEvent>(Room&)>&& event, Fill fill) {
  room.host().queue_event(std::move(event), [reactor, fill](const Result<RoomEvent>& decided) {
    if (decided) fill(*decided);
    reactor->Finish(decided ? Status::OK : status_of(decided.error()));
  });
  return reactor;
}

}  // namespace osteon
