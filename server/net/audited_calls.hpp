// Which calls stand in the audit log, and as what.
#pragma once
#include <memory>
#include <string_view>

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace osteon {

class AuditTrail;
class Authorizer;

// "DeleteRoom" of "/osteon.v1.RoomsService/DeleteRoom"; "call" of nothing.
[[nodiscard]] std::string_view call_name(std::string_view method);

// Whether a call is recorded also where it succeeds: whoever comes in, whatever an operator or instructor alone may do,
// and what takes data out of the server or brings it in. Cutting and drawing are in the room's journal, and not here.
[[nodiscard]] bool is_audited(std::string_view method);

// Records those, and of all other calls those that a handler refuses; the authorizer records what it refuses itself.
// `authorizer` says whose a call is; null: plain text. Both outlive the server.
[[nodiscard]] std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> audited_calls(
    AuditTrail& trail, Authorizer* authorizer);

}  // namespace osteon
