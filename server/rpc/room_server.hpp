// Serves rooms on the network: listens, serves proto/osteon/v1, stops cleanly.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/core/result.hpp"
#include "server/auth/authorizer.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/rooms/rooms.hpp"
#include "server/rpc/call_flood.hpp"
#include "server/rpc/link_server.hpp"
#include "server/rpc/listener.hpp"
#include "server/storage/room_store.hpp"

namespace osteon {

struct ConnectionOptions {
  std::filesystem::path certificates{};  // as in Authorizer::open; empty: plain text, on this machine alone
  std::size_t most_connections = 512;    // more connections are closed at once
  // A Unix socket at which a proxy of this machine passes calls on in plain text, and says who makes each
  // (peer_claims.hpp). Empty: none. Needs certificates.
  std::filesystem::path proxy_socket{};
  // Address for datagrams of the fast path: HOST:PORT, HOST numeric. Empty: the host of `listen`, at a port that the
  // system chooses.
  std::string udp_listen{};
  std::chrono::hours most_ticket_life{0};  // tickets valid for longer are refused; zero: none is
  FloodLimit flood{};                      // of calls over one connection
  // A client that is silent for this long is pinged. If it does not answer for as long again, its connection ends.
  std::chrono::milliseconds keepalive = std::chrono::seconds(10);
  // After this age, calls go over a new connection, with a new handshake and the authority's certificates at that time.
  // Streams go on over the old connection for `longest_session` more. Then it is closed, and sessions connect again by
  // themselves.
  std::chrono::milliseconds connection_age = std::chrono::hours(1), longest_session = std::chrono::hours(12);
};

struct ConnectionHealth {
  ListenerCounts connections;
  AuthorizerCounts authorizer;  // all zero over plain text
};

struct RoomServerOptions {
  std::string listen = "127.0.0.1:0";  // HOST:PORT on this machine; port 0 lets the system choose
  std::filesystem::path case_folder;   // sent to clients; holds the room's case
  std::filesystem::path save{};        // where the cut fields are written on request; empty: nowhere
  RuntimeRates rates{};
  Detail detail = Detail::automatic;
};

class RoomServer {
 public:
  // Checks whether start() could listen there now, so that an error shows before a long preparation. Errors as start().
  [[nodiscard]] static Result<void> check_listen(const std::string& listen, const ConnectionOptions& connections = {});
  // Errors: invalid_input (`listen` is not HOST:PORT, or not of this machine alone), exists (the port is in use),
  // unavailable (the system refuses for another reason, which is in the message).
  [[nodiscard]] static Result<std::unique_ptr<RoomServer>> start(std::unique_ptr<Rooms> rooms,
                                                                 const std::string& listen,
                                                                 const ConnectionOptions& connections = {});
  // Serves one room, named "room" or as in `store`. `progress` gets the progress of the first surface. `store` stores
  // this room; without it the room is lost when the process ends.
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
  // Admits nobody any more, reports this to grpc.health.v1, and asks every session to connect again later. Returns when
  // all sessions have gone and everything acknowledged to them is durable, when `most` is over, or when `give_up`
  // returns true. `give_up` waits for the time that it gets.
  void drain(std::chrono::milliseconds most, const std::function<bool(std::chrono::milliseconds)>& give_up);
  // Ends every stream with a status and joins all threads. Closes the journals cleanly, with a checkpoint. Call it
  // once.
  std::map<std::string, RoomSummary> stop_all();
  RoomSummary stop();  // the same, of the only room

 private:
  struct Impl;
  explicit RoomServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
