// Which room a call is to. For the sources of the services alone: gRPC stays out of headers.
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "server/net/gate.hpp"
#include "server/net/out_stream.inl"
#include "server/net/rooms.hpp"

namespace osteon {

inline std::string metadata_of(const grpc::CallbackServerContext& context, const char* key) {
  const auto named = context.client_metadata().find(key);
  return named == context.client_metadata().end() ? std::string() : std::string(named->second.data(), named->second.size());
}

inline tl::expected<Caller, Refusal> judged(Gate& gate, const grpc::CallbackServerContext& context, const std::string& room,
                                            std::string_view method) {
  const auto pem = context.auth_context()->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  const std::string ticket = metadata_of(context, "osteon-ticket");
  const std::string_view certificate = pem.empty() ? std::string_view() : std::string_view(pem[0].data(), pem[0].size());
  return gate.judge({.certificate_pem = certificate, .ticket = ticket, .room = room, .method = method});
}

// Who calls. Over plain text nobody says so: `user` is empty then, and the caller may do anything. Error denied: the caller's
// right has ended since the call was let in.
inline Result<Caller> caller_of(const Rooms& rooms, const grpc::CallbackServerContext& context) {
  if (!rooms.gate) return Caller{};
  auto caller = judged(*rooms.gate, context, metadata_of(context, "osteon-room-bin"), {});
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
  std::string named = metadata_of(context, "osteon-room-bin");
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

inline Status status_of(const Error& error) {
  std::string said = short_words(error.message);
  switch (error.code) {
    case ErrorCode::invalid_input: return invalid(std::move(said));
    case ErrorCode::not_found: return {StatusCode::NOT_FOUND, std::move(said)};
    case ErrorCode::denied: return {StatusCode::PERMISSION_DENIED, std::move(said)};
    case ErrorCode::exhausted: return {StatusCode::RESOURCE_EXHAUSTED, std::move(said)};
    case ErrorCode::exists: return {StatusCode::ALREADY_EXISTS, std::move(said)};
    case ErrorCode::unavailable:
    case ErrorCode::unsupported: return {StatusCode::FAILED_PRECONDITION, std::move(said)};
    default: return {StatusCode::INTERNAL, std::move(said)};
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
                                      std::function<Result<RoomEvent>(Room&)> event, Fill fill) {
  room.host().queue_event(std::move(event), [reactor, fill](const Result<RoomEvent>& decided) {
    if (decided) fill(*decided);
    reactor->Finish(decided ? Status::OK : status_of(decided.error()));
  });
  return reactor;
}

}  // namespace osteon
