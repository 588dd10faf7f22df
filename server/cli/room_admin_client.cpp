#include "server/cli/room_admin_client.hpp"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/rooms.grpc.pb.h"

namespace osteon {
namespace {

template <class Response, class Request>
Result<Response> ask(const std::shared_ptr<grpc::Channel>& channel,
                     grpc::Status (v1::RoomsService::Stub::*call)(grpc::ClientContext*, const Request&, Response*),
                     const Request& request, const std::string& in_room) {
  grpc::ClientContext context;
  if (!in_room.empty()) context.AddMetadata("osteon-room-bin", in_room);
  Response response;
  const auto stub = v1::RoomsService::NewStub(channel);
  const grpc::Status status = (stub.get()->*call)(&context, request, &response);
  if (!status.ok()) return tl::unexpected(wire::error_of_answer(status));
  return response;
}

template <class Response, class Request>
Result<Response> ask(const std::shared_ptr<grpc::Channel>& channel,
                     grpc::Status (v1::RoomsService::Stub::*call)(grpc::ClientContext*, const Request&, Response*),
                     const Request& request) {
  // The call names the room, since the role in that room may be higher than the ticket's role.
  if constexpr (requires { request.name(); }) return ask(channel, call, request, request.name());
  return ask(channel, call, request, "");
}

RoomLine line_of(const v1::RoomInfo& info) {
  return {.name = info.name(),
          .open = info.open(),
          .kept = info.persisted(),
          .replay = info.replay(),
          .case_title = info.case_title(),
          .room_seq = RoomSeq{info.room_seq()},
          .sessions = info.sessions(),
          .watchers = info.watchers(),
          .parent = info.parent(),
          .parent_room_seq = RoomSeq{info.parent_room_seq()}};
}

template <class Response>
Result<RoomLine> line_of(const Result<Response>& response) {
  if (!response) return tl::unexpected(response.error());
  return line_of(response->room());
}

}  // namespace

Result<RoomAdminClient> RoomAdminClient::reach(const std::string& address, std::chrono::milliseconds patience,
                                               const std::function<bool()>& stop,
                                               const wire::ClientCredentials& credentials) {
  // Connects as a haptic client does, so that a slow answer is awaited for as long.
  Result<std::shared_ptr<grpc::Channel>> channel =
      wire::reach_server(address, wire::ClientKind::haptic, patience, stop, credentials);
  if (!channel) return tl::unexpected(channel.error());
  return RoomAdminClient(std::move(*channel));
}

Result<std::vector<RoomLine>> RoomAdminClient::list() {
  const auto response = ask(channel_, &v1::RoomsService::Stub::ListRooms, v1::ListRoomsRequest{});
  if (!response) return tl::unexpected(response.error());
  std::vector<RoomLine> lines;
  for (const v1::RoomInfo& info : response->rooms()) lines.push_back(line_of(info));
  return lines;
}

Result<RoomLine> RoomAdminClient::create(const std::string& name, const std::string& case_hash_hex) {
  v1::CreateRoomRequest request;
  request.set_name(name);
  if (!case_hash_hex.empty()) {
    const Result<Digest> hash = digest_from_hex(case_hash_hex);
    if (!hash)
      return failure(ErrorCode::invalid_input, "--case-hash " + case_hash_hex + " is not 64 hexadecimal digits");
    request.set_case_hash(wire::to_wire(*hash));
  }
  return line_of(ask(channel_, &v1::RoomsService::Stub::CreateRoom, request));
}

Result<RoomLine> RoomAdminClient::close(const std::string& name) {
  v1::CloseRoomRequest request;
  request.set_name(name);
  return line_of(ask(channel_, &v1::RoomsService::Stub::CloseRoom, request));
}

Result<RoomLine> RoomAdminClient::resume(const std::string& name) {
  v1::ResumeRoomRequest request;
  request.set_name(name);
  return line_of(ask(channel_, &v1::RoomsService::Stub::ResumeRoom, request));
}

Result<RoomLine> RoomAdminClient::branch(const std::string& name, const std::string& new_name, RoomSeq to) {
  v1::BranchRoomRequest request;
  request.set_name(name);
  request.set_new_name(new_name);
  request.set_room_seq(to.value);
  return line_of(ask(channel_, &v1::RoomsService::Stub::BranchRoom, request));
}

Result<RoomLine> RoomAdminClient::replay(const std::string& name, const std::string& new_name, RoomSeq from, RoomSeq to,
                                         double speed) {
  v1::ReplayRoomRequest request;
  request.set_name(name);
  request.set_new_name(new_name);
  request.set_from_room_seq(from.value);
  request.set_to_room_seq(to.value);
  request.set_speed(speed);
  return line_of(ask(channel_, &v1::RoomsService::Stub::ReplayRoom, request));
}

Result<std::vector<std::string>> RoomAdminClient::remove(const std::string& name, bool with_branches) {
  v1::DeleteRoomRequest request;
  request.set_name(name);
  request.set_with_branches(with_branches);
  // With the ticket's own room: who made a branch has a ticket for the room that it was made from.
  const auto response = ask(channel_, &v1::RoomsService::Stub::DeleteRoom, request, "");
  if (!response) return tl::unexpected(response.error());
  return std::vector<std::string>(response->deleted().begin(), response->deleted().end());
}

Result<RoomAdminClient::Checked> RoomAdminClient::verify(const std::string& name) {
  v1::VerifyRoomRequest request;
  request.set_name(name);
  const auto response = ask(channel_, &v1::RoomsService::Stub::VerifyRoom, request);
  if (!response) return tl::unexpected(response.error());
  const Result<Digest> chain = wire::digest_from_wire(response->chain());
  const Result<Digest> fields = wire::digest_from_wire(response->field_hash());
  if (!chain || !fields) return failure(ErrorCode::unsupported, "the server does not answer as an Osteon server does");
  return Checked{RoomSeq{response->room_seq()},
                 *chain,
                 *fields,
                 response->checkpoints(),
                 {response->faults().begin(), response->faults().end()}};
}

Result<RoomAdminClient::Copied> RoomAdminClient::back_up(const std::string& name, const std::string& file_name) {
  v1::BackUpRoomRequest request;
  request.set_name(name);
  request.set_file_name(file_name);
  const auto response = ask(channel_, &v1::RoomsService::Stub::BackUpRoom, request);
  if (!response) return tl::unexpected(response.error());
  return Copied{RoomSeq{response->room_seq()}, response->file()};
}

}  // namespace osteon
