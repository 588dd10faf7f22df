// Notes refusals that do not come from the authorizer: failed handshakes, which only gRPC sees, and calls with invalid
// messages.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/auth/connections.hpp"
#include "server/auth/refusals.hpp"

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace osteon {

class AuditTrail;

// While it lives, a handshake that fails before any certificate is seen is noted as "tls". The client may have no
// certificate or speak plain text. gRPC reports such failures only in its log, for the whole process and without an
// address. The rest of that log is dropped. The addresses noted are those of all connections over which no call has
// come. Any thread may call it.
class HandshakeWatch {
 public:
  HandshakeWatch(RefusalCounts& refusals, Connections& connections);  // both outlive this object
  ~HandshakeWatch();
  void note(const std::string& who, std::string_view said);
  // The trail records every one of them. It outlives this object. Call it before the first connection.
  void set_trail(AuditTrail& trail) { trail_ = &trail; }
  HandshakeWatch(const HandshakeWatch&) = delete;
  HandshakeWatch& operator=(const HandshakeWatch&) = delete;

 private:
  RefusalCounts& refusals_;
  Connections& connections_;
  AuditTrail* trail_ = nullptr;  // null: nothing is recorded
};

// The trailing header of a call that the authorizer refused: its reason in one word. The authorizer has noted the call.
inline constexpr const char* kRefusalTrailer = "osteon-refusal";

// Logs why a call failed, with the paths that its caller does not receive, within the limit of RefusalLog. Any thread.
void log_failed_call(std::string_view why);

// Notes every call that ends because of its message. The message was malformed or nonsense ("request"), asked for too
// much ("quota"), or was not allowed for its caller ("denied"). The call is noted under the caller's address. Join and
// the authorizer note their own refusals. `refusals` outlives the server.
[[nodiscard]] std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> refused_call_notes(
    RefusalCounts& refusals);

}  // namespace osteon
