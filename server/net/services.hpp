// The gRPC services of a server's rooms.
#pragma once
#include <memory>
#include <string_view>

#include "common/core/digest.hpp"
#include "server/net/rooms.hpp"

namespace grpc {
class CallbackGenericService;
class Service;
}  // namespace grpc

namespace osteon {

class LinkServer;

// What the room keeps of a secret: enough to know it again.
[[nodiscard]] Digest digest_of_secret(std::string_view secret);

// The rooms must outlive the services, and they the server that they are registered with.
[[nodiscard]] std::unique_ptr<grpc::Service> make_room_service(Rooms& rooms);
// `links`: the fast path; null: there is none, and all goes over the streams.
[[nodiscard]] std::unique_ptr<grpc::Service> make_cutting_service(Rooms& rooms, LinkServer* links);
[[nodiscard]] std::unique_ptr<grpc::Service> make_watch_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_people_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_rooms_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_case_service(Rooms& rooms);
// Answers every call that none of them has.
[[nodiscard]] std::unique_ptr<grpc::CallbackGenericService> make_unknown_calls(Rooms& rooms);

}  // namespace osteon
