#include "server/rpc/audited_calls.hpp"

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_interceptor.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <utility>

#include "common/access/role_table.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/cases.pb.h"
#include "osteon/v1/people.pb.h"
#include "osteon/v1/room.pb.h"
#include "osteon/v1/rooms.pb.h"
#include "server/audit/audit_trail.hpp"
#include "server/auth/authorizer.hpp"
#include "server/auth/peer_claims.hpp"
#include "server/rpc/refused_calls.hpp"

namespace osteon {
namespace {

using grpc::StatusCode;
using grpc::experimental::InterceptionHookPoints;

// Adds what a message says about the call. Before this, the event's object is the room of the call's ticket.
using Describe = void (*)(const void* message, AuditEvent& event);

// For a message that names the room itself.
template <class Request>
void name_room(const void* message, AuditEvent& event) {
  event.object = static_cast<const Request*>(message)->name();
}

// For a message that makes another room from the named one.
template <class Request>
void name_both(const void* message, AuditEvent& event) {
  const auto& request = *static_cast<const Request*>(message);
  event.object = request.name();
  event.detail = "as " + request.new_name();
}

void describe_join(const void* message, AuditEvent& event) {
  const auto& request = *static_cast<const v1::JoinRequest*>(message);
  event.detail = v1::ClientKind_Name(request.kind());
  if (event.who.certificate.empty() && !request.name().empty())
    event.who.person = std::string(kClaimed) + request.name();
}

void describe_joined(const void* message, AuditEvent& event) {
  const auto& response = *static_cast<const v1::JoinResponse*>(message);
  event.object = response.room();
  event.detail += " author " + std::to_string(response.author());
}

// The restrictions that hold from now on. The words are left out: they are in the journal, where they can be erased.
void describe_supervision(const void* message, AuditEvent& event) {
  const auto& request = *static_cast<const v1::SuperviseRequest*>(message);
  const v1::Restrictions& all = request.supervision();
  event.detail = request.subject() == 0 ? "everybody:" : "author " + std::to_string(request.subject()) + ":";
  if (all.stopped()) event.detail += " stopped";
  if (all.taken_by() != 0) event.detail += " tool taken";
  if (all.guide() != 0) event.detail += " guided";
  if (all.force_limit() != 0) event.detail += " force limited";
  if (all.has_zone()) event.detail += " zone limited";
  if (all.tools_size() > 0) event.detail += " tools limited";
  if (event.detail.ends_with(':')) event.detail += " free";
}

void describe_demonstration(const void* message, AuditEvent& event) {
  const auto& request = *static_cast<const v1::DemonstrateRequest*>(message);
  if (!request.room().empty()) event.detail = "of room " + request.room();
}

void describe_save(const void* message, AuditEvent& event) {
  event.detail = static_cast<const v1::SaveFieldsRequest*>(message)->file_name();
}

void describe_backup(const void* message, AuditEvent& event) {
  const auto& request = *static_cast<const v1::BackUpRoomRequest*>(message);
  event.object = request.name();
  event.detail = "as " + request.file_name();
}

void describe_deletion(const void* message, AuditEvent& event) {
  const auto& request = *static_cast<const v1::DeleteRoomRequest*>(message);
  event.object = request.name();
  if (request.with_branches()) event.detail = "with branches";
}

void describe_upload(const void* message, AuditEvent& event) {
  const Result<Digest> hash =
      wire::digest_from_wire(static_cast<const v1::UploadCaseResponse*>(message)->stored().case_hash());
  if (hash) event.object = "case " + to_hex(*hash);
}

struct Row {
  std::string_view method;
  Describe request = nullptr, response = nullptr;  // null: the message adds nothing
  bool is_stream = false;                          // a stream from the server: it is recorded when it begins
};
constexpr std::array kAudited{
    Row{"/osteon.v1.RoomService/Join", describe_join, describe_joined},
    Row{"/osteon.v1.CuttingService/Session", nullptr, nullptr, true},
    Row{"/osteon.v1.RoomService/GetCase", nullptr, nullptr, true},
    Row{"/osteon.v1.FieldService/WatchField", nullptr, nullptr, true},
    Row{"/osteon.v1.RoomService/SaveFields", describe_save},
    Row{"/osteon.v1.RoomService/RemoveBody"},
    Row{"/osteon.v1.PeopleService/Supervise", describe_supervision},
    Row{"/osteon.v1.PeopleService/Demonstrate", describe_demonstration},
    Row{"/osteon.v1.PeopleService/EndDemonstration"},
    Row{"/osteon.v1.RoomsService/CreateRoom", name_room<v1::CreateRoomRequest>},
    Row{"/osteon.v1.RoomsService/CloseRoom", name_room<v1::CloseRoomRequest>},
    Row{"/osteon.v1.RoomsService/ResumeRoom", name_room<v1::ResumeRoomRequest>},
    Row{"/osteon.v1.RoomsService/BranchRoom", name_both<v1::BranchRoomRequest>},
    Row{"/osteon.v1.RoomsService/DeleteRoom", describe_deletion},
    Row{"/osteon.v1.RoomsService/VerifyRoom", name_room<v1::VerifyRoomRequest>},
    Row{"/osteon.v1.RoomsService/BackUpRoom", describe_backup},
    Row{"/osteon.v1.RoomsService/ReplayRoom", name_both<v1::ReplayRoomRequest>},
    Row{"/osteon.v1.CaseService/UploadCase", nullptr, describe_upload},
};

const Row* find_row(std::string_view method) {
  const auto row = std::ranges::find(kAudited, method, &Row::method);
  return row == kAudited.end() ? nullptr : &*row;
}

// A fixed word. The server's own sentences are not used, since they may name people.
std::string word_of(StatusCode code) {
  switch (code) {
    case StatusCode::INVALID_ARGUMENT:
      return "invalid argument";
    case StatusCode::NOT_FOUND:
      return "not found";
    case StatusCode::ALREADY_EXISTS:
      return "exists already";
    case StatusCode::PERMISSION_DENIED:
      return "permission denied";
    case StatusCode::UNAUTHENTICATED:
      return "unauthenticated";
    case StatusCode::RESOURCE_EXHAUSTED:
      return "quota";
    case StatusCode::FAILED_PRECONDITION:
      return "not possible now";
    case StatusCode::UNIMPLEMENTED:
      return "no such call";
    case StatusCode::UNAVAILABLE:
      return "unavailable";
    case StatusCode::CANCELLED:
      return "cancelled";
    case StatusCode::DEADLINE_EXCEEDED:
      return "too late";
    default:
      return "code " + std::to_string(code);
  }
}

bool is_refusal(StatusCode code) {
  constexpr std::array kRefusals{StatusCode::PERMISSION_DENIED, StatusCode::UNAUTHENTICATED,
                                 StatusCode::RESOURCE_EXHAUSTED, StatusCode::INVALID_ARGUMENT,
                                 StatusCode::UNIMPLEMENTED};
  return std::ranges::find(kRefusals, code) != kRefusals.end();
}

std::string header(const grpc::ServerContextBase& context, const char* key) {
  const auto [first, last] = context.client_metadata().equal_range(key);
  if (first == last || std::next(first) != last) return {};
  return {first->second.data(), first->second.size()};
}

// One call. gRPC runs its hooks one after another.
class AuditedCall final : public grpc::experimental::Interceptor {
 public:
  AuditedCall(AuditTrail& trail, Authorizer* authorizer, grpc::experimental::ServerRpcInfo& call)
      : trail_(trail), authorizer_(authorizer), call_(call), row_(find_row(call.method())) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using Point = InterceptionHookPoints;
    if (row_ && row_->request && methods->QueryInterceptionHookPoint(Point::POST_RECV_MESSAGE))
      if (const void* request = methods->GetRecvMessage()) row_->request(request, begun());
    if (row_ && methods->QueryInterceptionHookPoint(Point::PRE_SEND_MESSAGE)) {
      if (row_->is_stream && !std::exchange(recorded_, true)) record(kOk, "");
      if (row_->response)
        if (const void* response = methods->GetSendMessage()) row_->response(response, begun());
    }
    if (methods->QueryInterceptionHookPoint(Point::PRE_SEND_STATUS)) {
      const auto* trailers = methods->GetSendTrailingMetadata();
      const bool is_authorizers = trailers != nullptr && trailers->contains(kRefusalTrailer);
      if (!is_authorizers) end(methods->GetSendStatus().error_code());
    }
    methods->Proceed();
  }

 private:
  // Person and address, as far as the connection and the headers say them.
  AuditEvent& begun() {
    if (!event_.action.empty()) return event_;
    const grpc::ServerContextBase& context = *call_.server_context();
    const PeerClaims peer = peer_claims(context);
    const std::string ticket = header(context, "osteon-ticket"), room = header(context, "osteon-room-bin");
    event_.action = call_name(call_.method());
    event_.object = room;
    event_.who.address = peer.address;
    if (authorizer_) {
      Authorizer::CallTrace trace = authorizer_->trace_of({.peer = peer, .ticket = ticket, .room = room});
      event_.who = std::move(trace.who);
      event_.object = std::move(trace.room);
    }
    return event_;
  }
  void end(StatusCode code) {
    const bool refused = is_refusal(code);
    if (!refused && (!row_ || recorded_)) return;
    record(code == StatusCode::OK ? kOk : refused ? kRefused : kFailed, code == StatusCode::OK ? "" : word_of(code));
  }
  void record(const char* result, const std::string& why) {
    AuditEvent event = begun();
    event.result = result;
    if (!why.empty()) event.detail += (event.detail.empty() ? "" : ": ") + why;
    event.at = std::chrono::system_clock::now();
    trail_.record(std::move(event));
  }

  AuditTrail& trail_;
  Authorizer* const authorizer_;
  grpc::experimental::ServerRpcInfo& call_;
  const Row* const row_;  // null: audited only if the call is refused
  AuditEvent event_{.action = "", .result = kOk};
  bool recorded_ = false;
};

class AuditedCalls final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  AuditedCalls(AuditTrail& trail, Authorizer* authorizer) : trail_(trail), authorizer_(authorizer) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) override {
    return new AuditedCall(trail_, authorizer_, *call);  // gRPC deletes it
  }

 private:
  AuditTrail& trail_;
  Authorizer* const authorizer_;
};

}  // namespace

bool is_audited(std::string_view method) { return find_row(method) != nullptr; }

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> audited_calls(AuditTrail& trail,
                                                                                     Authorizer* authorizer) {
  return std::make_unique<AuditedCalls>(trail, authorizer);
}

}  // namespace osteon
