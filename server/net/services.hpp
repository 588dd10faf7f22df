// The gRPC services of a hosted room.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "server/net/room_host.hpp"

namespace grpc {
class Service;
}

namespace osteon {

class LinkServer;

// What the room keeps of a secret: enough to know it again.
[[nodiscard]] Digest digest_of_secret(std::string_view secret);

struct RoomFiles {
  std::filesystem::path case_folder;  // of the room's case
  std::filesystem::path save;         // where the cut fields are written on request; empty: nowhere
};

// The host must outlive the services, and they the server that they are registered with.
[[nodiscard]] std::unique_ptr<grpc::Service> make_room_service(RoomHost& host, RoomFiles files,
                                                               std::uint64_t server_epoch);
// `links`: the fast path; null: there is none, and all goes over the streams.
[[nodiscard]] std::unique_ptr<grpc::Service> make_cutting_service(RoomHost& host, std::uint64_t server_epoch, LinkServer* links);
[[nodiscard]] std::unique_ptr<grpc::Service> make_watch_service(RoomHost& host);

}  // namespace osteon
