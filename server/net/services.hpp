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

struct RoomFiles {
  std::filesystem::path case_folder;  // of the room's case
  std::filesystem::path save;         // where the cut fields are written on request; empty: nowhere
};

// The host must outlive the services, and they the server that they are registered with.
[[nodiscard]] std::unique_ptr<grpc::Service> make_room_service(RoomHost& host, RoomFiles files,
                                                               std::uint64_t server_epoch);
[[nodiscard]] std::unique_ptr<grpc::Service> make_cutting_service(RoomHost& host, std::uint64_t server_epoch);
[[nodiscard]] std::unique_ptr<grpc::Service> make_watch_service(RoomHost& host);

}  // namespace osteon
