// Connects to a server and joins its room, as every client does first.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/wire/credentials.hpp"

namespace grpc {
class Channel;
}

namespace osteon::wire {

// Translates gRPC's text for a plain HTTP answer, from a proxy or from a server without gRPC. `server`: how messages
// name it. Nothing: it is no such text.
[[nodiscard]] std::optional<Error> error_of_http(const std::string& said, const std::string& server);

enum class ClientKind { haptic = 1, viewer = 2, audio = 3, console = 4 };

struct JoinedRoom {
  std::shared_ptr<grpc::Channel> channel;  // shared with every stub made from it; every call over it goes to this room
  std::string name;
  AuthorId author;
  std::uint64_t server_epoch = 0;
  std::uint64_t lease_epoch = 0;
  Digest case_hash;
  std::string case_title;
  double pitch_mm = 0;
  Box bounds;
  RoomSeq room_seq;
  std::string secret;  // proves that a later connection belongs to this one
};

// How long a client tries to connect. A refusal comes at once: nothing listens there, but a server may be about to.
struct ReachPatience {
  // Not explicit: most callers wait as long for either.
  template <class Rep, class Period>
  ReachPatience(std::chrono::duration<Rep, Period> each) : all(each), refused(each) {}
  ReachPatience(std::chrono::milliseconds any, std::chrono::milliseconds a_refusal) : all(any), refused(a_refusal) {}
  std::chrono::milliseconds all, refused;
};

// A channel to the server that names no room. Errors: invalid_input (`address` is not HOST:PORT), those of
// connection_fault (no connection within `patience`, or waiting does not help), cancelled (`stop` returned true), and
// those of channel_credentials.
[[nodiscard]] Result<std::shared_ptr<grpc::Channel>> reach_server(const std::string& address, ClientKind kind,
                                                                  ReachPatience patience,
                                                                  const std::function<bool()>& stop,
                                                                  const ClientCredentials& credentials = {});

// `name`: the caller's, shown to others. `room`: the room to join; empty: the only open room. Errors: those of
// reach_server, unsupported (protocol or kernel versions differ, or the room is closed), not_found (there is no such
// room), denied (the person, ticket or role is not admitted).
[[nodiscard]] Result<JoinedRoom> join_room(const std::string& address, ClientKind kind, const std::string& name,
                                           ReachPatience patience, const std::function<bool()>& stop,
                                           const std::string& room = {}, const ClientCredentials& credentials = {});

// Joins again as the same author over the same channel, after the stream or the server was lost. `kept`: the newest
// event that the server reported as durable, its chain and the server's seal. Errors: unavailable (try again), any
// other (the room does not know this client any more).
struct DurableSeq {
  RoomSeq room_seq;
  Digest chain, seal;
};
[[nodiscard]] Result<JoinedRoom> join_again(const JoinedRoom& room, ClientKind kind,
                                            const std::optional<DurableSeq>& kept);

}  // namespace osteon::wire
