// Finds the caller and the room of a call. Only for the source files of the services, since gRPC stays out of headers.
#pragma once
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
#include "server/auth/authorizer.hpp"
#include "server/auth/peer_claims.hpp"
#include "server/rooms/rooms.hpp"
#include "server/rpc/out_stream.inl"
#include "server/rpc/refused_calls.hpp"

namespace osteon {

// The value of a header; "" if it is missing. Nothing if it came twice, since two readers might use different values.
inline std::optional<std::string> metadata_of(const grpc::CallbackServerContext& context, const char* key) {
  const auto [first, last] = context.client_metadata().equal_range(key);
  if (first == last) return std::string();
  if (std::next(first) != last) return {};
  return std::string(first->second.data(), first->second.size());
}

// The headers that a call may have beside those of HTTP/2 and gRPC, which gRPC does not pass on.
inline bool is_known_header(std::string_view name, bool by_proxy) {
  static constexpr std::array<std::string_view, 6> kKnown{"osteon-ticket",        "osteon-room-bin", "user-agent",
                                                          "grpc-accept-encoding", "accept-encoding", "grpc-trace-bin"};
  if (by_proxy && (name == kCertificateHeader || name == kAddressHeader)) return true;
  return std::ranges::find(kKnown, name) != kKnown.end();
}

inline tl::expected<Caller, Refusal> judged(Authorizer& authorizer, const grpc::CallbackServerContext& context,
                                            const std::string& room, std::string_view method) {
  const PeerClaims peer = peer_claims(context);
  const std::string ticket = metadata_of(context, "osteon-ticket").value_or("");
  return authorizer.judge({.peer = peer, .ticket = ticket, .room = room, .method = method});
}

// Authorizes a call at its beginning: certificate, ticket, role, headers and rate. Null: the call is allowed. Every
// handler begins with this. It is the only place where calls are counted as admitted or refused. `about`: the room that
// the message names, for a ticket of every room.
inline std::optional<Status> refusal_of(const Rooms& rooms, grpc::CallbackServerContext& context,
                                        std::string_view method, std::string_view about = {}) {
  if (!rooms.authorizer) return {};
  const PeerClaims peer = peer_claims(context);
  const std::optional<std::string> room = metadata_of(context, "osteon-room-bin"),
                                   ticket = metadata_of(context, "osteon-ticket");
  const CallClaims call{.peer = peer,
                        .ticket = ticket ? std::string_view(*ticket) : std::string_view(),
                        .room = room ? std::string_view(*room) : std::string_view(),
                        .method = method,
                        .about = about};
  // Sends programs the reason, and lets refused_call_notes() know that the refusal was noted.
  const auto tell = [&](std::string_view reason) { context.AddTrailingMetadata(kRefusalTrailer, std::string(reason)); };
  const auto wrong = [&](const std::string& sentence) {
    tell("request");
    rooms.authorizer->note_refused("request", sentence, call);
    return Status(StatusCode::INVALID_ARGUMENT, short_words(sentence));
  };
  for (const auto& [key, value] : context.client_metadata())
    if (!is_known_header({key.data(), key.size()}, peer.by_proxy))
      return wrong("the call has a header that this server does not know; leave out " +
                   std::string(key.data(), key.size()));
  if (!room || !ticket) return wrong("the call says twice which ticket or room is meant");
  const auto caller = rooms.authorizer->admit(call);
  if (caller) return {};
  tell(caller.error().reason);
  return status_of(caller.error());
}

// The call of a request: "/osteon.v1.RoomService/Undo" for v1::UndoRequest. Requests are named after their calls; a
// test checks this for the whole protocol.
template <class Request>
std::string_view method_of() {
  static const CallRow* const entry = [] {
    const std::string_view request = Request::descriptor()->name();
    const std::string end = "/" + std::string(request.substr(0, request.size() - std::string_view("Request").size()));
    const auto found = std::ranges::find_if(call_rows(), [&](const CallRow& one) { return one.method.ends_with(end); });
    OSTEON_CHECK(found != call_rows().end());
    return &*found;
  }();
  return entry->method;
}

// The same for the call of that request.
template <class Request>
std::optional<Status> refusal_of(const Rooms& rooms, grpc::CallbackServerContext& context) {
  return refusal_of(rooms, context, method_of<Request>());
}

// The same for a call with one answer. Returns false if the call was answered with the refusal.
template <class Request>
bool admitted(const Rooms& rooms, grpc::CallbackServerContext& context, grpc::ServerUnaryReactor* reactor) {
  std::optional<Status> refusal = refusal_of<Request>(rooms, context);
  if (refusal) reactor->Finish(std::move(*refusal));
  return !refusal;
}

// The person who calls. Over plain text this is unknown: `user` is empty, and the caller may do anything. Error denied:
// the caller's right has ended since the call was admitted.
inline Result<Caller> caller_of(const Rooms& rooms, const grpc::CallbackServerContext& context) {
  if (!rooms.authorizer) return Caller{};
  auto caller = judged(*rooms.authorizer, context, metadata_of(context, "osteon-room-bin").value_or(""), {});
  if (!caller) return failure(ErrorCode::denied, caller.error().sentence);
  return std::move(*caller);
}

// The same, with the role in `room`, which is not empty. For a call whose message names rooms. These may differ from
// the room in the metadata, for which the call was admitted. Error denied: the ticket is not for that room, or the role
// there may not make the call `method`.
inline Result<Caller> caller_in(const Rooms& rooms, const grpc::CallbackServerContext& context, const std::string& room,
                                std::string_view method) {
  if (!rooms.authorizer) return Caller{};
  auto caller = judged(*rooms.authorizer, context, room, method);
  if (!caller) return failure(ErrorCode::denied, "not in room " + room + ": " + caller.error().sentence);
  return std::move(*caller);
}

// By the call's metadata "osteon-room-bin". Without it, the room of the ticket, or the only open room.
inline Result<std::shared_ptr<OpenRoom>> called_room(const Rooms& rooms, const grpc::CallbackServerContext& context) {
  const Result<Caller> caller = caller_of(rooms, context);
  if (!caller) return tl::unexpected(caller.error());
  std::string named = metadata_of(context, "osteon-room-bin").value_or("");
  if (named.empty() && caller->ticket_room != kAnyRoom) named = caller->ticket_room;
  return rooms.find(named);
}

// The same for a call that is made as `author`. Error denied: the caller is not this author.
inline Result<std::shared_ptr<OpenRoom>> called_room(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                                     AuthorId author) {
  Result<std::shared_ptr<OpenRoom>> room = called_room(rooms, context);
  if (!room || !rooms.authorizer) return room;
  const Result<Caller> caller = caller_of(rooms, context);
  if (!caller) return tl::unexpected(caller.error());
  if (const Result<void> own = rooms.authorizer->check_author(*caller, (*room)->name, author); !own)
    return tl::unexpected(own.error());
  return room;
}

// The status has no paths; the log has them.
inline Status status_of(const Error& error) {
  if (without_paths(error.message) != error.message) log_failed_call(error.message);
  const std::string said = short_words(error.message);
  switch (error.code) {
    case ErrorCode::invalid_input:
      return invalid(said);
    case ErrorCode::not_found:
      return {StatusCode::NOT_FOUND, said};
    case ErrorCode::denied:
      return {StatusCode::PERMISSION_DENIED, said};
    case ErrorCode::exhausted:
      return {StatusCode::RESOURCE_EXHAUSTED, said};
    case ErrorCode::exists:
      return {StatusCode::ALREADY_EXISTS, said};
    case ErrorCode::unavailable:
    case ErrorCode::unsupported:
      return {StatusCode::FAILED_PRECONDITION, said};
    default:
      return {StatusCode::INTERNAL, said};
  }
}

// Answers a call that is not carried out.
inline grpc::ServerUnaryReactor* refuse(grpc::ServerUnaryReactor* reactor, Status status) {
  reactor->Finish(std::move(status));
  return reactor;
}

// The room of a call with one answer. Null: `reactor` was given the reason.
inline std::shared_ptr<OpenRoom> room_of(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                         grpc::ServerUnaryReactor* reactor) {
  Result<std::shared_ptr<OpenRoom>> room = called_room(rooms, context);
  if (room) return std::move(*room);
  refuse(reactor, status_of(room.error()));
  return nullptr;
}

// The same for a call that is made as `author`, whether the author has joined or not.
inline std::shared_ptr<OpenRoom> room_of(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                         grpc::ServerUnaryReactor* reactor, AuthorId author) {
  Result<std::shared_ptr<OpenRoom>> room = called_room(rooms, context, author);
  if (room) return std::move(*room);
  refuse(reactor, status_of(room.error()));
  return nullptr;
}

// The same for a request whose author has joined.
template <class Request>
std::shared_ptr<OpenRoom> room_of_member(const Rooms& rooms, const grpc::CallbackServerContext& context,
                                         grpc::ServerUnaryReactor* reactor, const Request& request) {
  const AuthorId author{request.author()};
  std::shared_ptr<OpenRoom> room = room_of(rooms, context, reactor, author);
  if (!room || room->runtime().knows(author)) return room;
  refuse(reactor, not_joined(std::string(Request::descriptor()->name()).c_str(), author.value));
  return nullptr;
}

// Queues an event of the room. The call is answered when every session was sent the event; `fill` makes the answer.
template <class Fill>
grpc::ServerUnaryReactor* change_room(OpenRoom& room, grpc::ServerUnaryReactor* reactor,
                                      std::function<Result<RoomEvent>(Room&)>&& event, Fill fill) {
  room.runtime().queue_event(std::move(event), [reactor, fill](const Result<RoomEvent>& decided) {
    if (decided) fill(*decided);
    reactor->Finish(decided ? Status::OK : status_of(decided.error()));
  });
  return reactor;
}

}  // namespace osteon
