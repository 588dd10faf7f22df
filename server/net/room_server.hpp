// Rooms on the network: listens, serves proto/osteon/v1, stops cleanly.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/core/result.hpp"
#include "server/net/authorizer.hpp"
#include "server/net/call_flood.hpp"
#include "server/net/link_server.hpp"
#include "server/net/listener.hpp"
#include "server/net/room_runtime.hpp"
#include "server/net/room_store.hpp"
#include "server/net/rooms.hpp"

namespace osteon {

struct ConnectionOptions {
  std::filesystem::path certificates{};  // as Authorizer::open has them; empty: plain text, on this machine alone
  std::size_t most_connections = 512;    // further ones are closed at once
  // A Unix socket at which a proxy of this machine brings calls in plain text, and says of each whose it is
  // (peer_claims.hpp); empty: there is none. Needs certificates.
  std::filesystem::path proxy_socket{};
  // Where datagrams of the fast path come in: HOST:PORT, HOST numeric. Empty: where connections do, at a port that the
  // system chooses.
  std::string udp_listen{};
  std::chrono::hours most_ticket_life{0};  // tickets that are good for longer are refused; zero: none is
  FloodLimit flood{};                      // of calls over one connection
  // After so long without a word a client is asked whether it lives; one that does not answer for as long again is
  // gone.
  std::chrono::milliseconds keepalive = std::chrono::seconds(10);
  // After which calls go over a new connection, with a new handshake and the authority's certificates as they are then.
  // Streams go on over the old one for `longest_session` more; then it is closed, and sessions come again by
  // themselves.
  std::chrono::milliseconds connection_age = std::chrono::hours(1), longest_session = std::chrono::hours(12);
};

struct ConnectionHealth {
  ListenerCounts connections;
  AuthorizerCounts authorizer;  // of none over plain text
};

struct RoomServerOptions {
  std::string listen = "127.0.0.1:0";  // HOST:PORT on this machine; port 0 lets the system choose
  std::filesystem::path case_folder;   // what clients are sent; holds the room's case
  std::filesystem::path save{};        // where the cut fields are written on request; empty: nowhere
  RuntimeRates rates{};
  Detail detail = Detail::automatic;
};

class RoomServer {
 public:
  // Whether start() could listen there now: told before a long preparation instead of after it. Errors as start().
  [[nodiscard]] static Result<void> check_listen(const std::string& listen, const ConnectionOptions& connections = {});
  // Errors: invalid_input (`listen` is not HOST:PORT, or not of this machine alone), exists (the port is in use),
  // unavailable (the system refuses for another reason, which the message gives).
  [[nodiscard]] static Result<std::unique_ptr<RoomServer>> start(std::unique_ptr<Rooms> rooms,
                                                                 const std::string& listen,
                                                                 const ConnectionOptions& connections = {});
  // Of one room, "room" or what `store` calls it. `progress` hears how far the first surface is. `store`: of this room;
  // without one it is lost when the process ends.
  [[nodiscard]] static Result<std::unique_ptr<RoomServer>> start(Room room, const RoomServerOptions& options,
                                                                 const std::function<void(double)>& progress,
                                                                 std::unique_ptr<RoomStore> store = nullptr);
  ~RoomServer();
  RoomServer(const RoomServer&) = delete;
  RoomServer& operator=(const RoomServer&) = delete;

  [[nodiscard]] const std::string& address() const;  // HOST:PORT with the real port
  [[nodiscard]] Rooms& rooms();
  [[nodiscard]] RuntimeHealth health() const;     // of the only room
  [[nodiscard]] std::uint16_t link_port() const;  // UDP; 0: there is no fast path
  [[nodiscard]] LinkServerHealth link_health() const;
  [[nodiscard]] ConnectionHealth connection_health() const;
  // Lets nobody in any more, tells grpc.health.v1 so, asks every session to come again later, and returns when all have
  // gone with what they were told being kept, when `most` is over, or when `give_up`, which waits that long, returns
  // true.
  void drain(std::chrono::milliseconds most, const std::function<bool(std::chrono::milliseconds)>& give_up);
  // Ends every stream with a status and joins all threads; the journals are closed cleanly, with a checkpoint. Once.
  std::map<std::string, RoomSummary> stop_all();
  RoomSummary stop();  // the same, of the only room

 private:
  struct Impl;
  explicit RoomServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
