// Makes the gRPC services of a server's rooms.
#pragma once
#include <memory>
#include <string_view>

#include "common/core/digest.hpp"
#include "server/rooms/rooms.hpp"

namespace grpc {
class CallbackGenericService;
class Service;
}  // namespace grpc

namespace osteon {

class LinkServer;

// The digest of a secret that a room stores, to recognise the secret again.
[[nodiscard]] Digest digest_of_secret(std::string_view secret);

// The rooms must outlive the services, and the services must outlive the server at which they are registered.
[[nodiscard]] std::unique_ptr<grpc::Service> make_room_service(Rooms& rooms);
// `links`: the fast path; null: there is none, and everything goes over the streams.
[[nodiscard]] std::unique_ptr<grpc::Service> make_cutting_service(Rooms& rooms, LinkServer* links);
[[nodiscard]] std::unique_ptr<grpc::Service> make_watch_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_field_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_people_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_plan_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_room_admin_service(Rooms& rooms);
[[nodiscard]] std::unique_ptr<grpc::Service> make_case_service(Rooms& rooms);
// Answers every call that none of these services has.
[[nodiscard]] std::unique_ptr<grpc::CallbackGenericService> make_unknown_calls(Rooms& rooms);

}  // namespace osteon
