// Says which calls the audit log records, and under which name.
#pragma once
#include <memory>
#include <string_view>

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace osteon {

class AuditTrail;
class Authorizer;

// Whether a call is recorded even if it succeeds. Recorded are: every entry of a client, all calls that only an
// operator or instructor may make, and all that move data out of or into the server. Cuts and drawings are not recorded
// here, since the room's journal has them.
[[nodiscard]] bool is_audited(std::string_view method);

// Records these calls. Of all other calls, records those that a handler refuses; the authorizer records its own
// refusals. `authorizer` says who makes a call; null: plain text. Both outlive the server.
[[nodiscard]] std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> audited_calls(
    AuditTrail& trail, Authorizer* authorizer);

}  // namespace osteon
