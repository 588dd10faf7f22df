// What is refused beside the gate: handshakes that fail, which gRPC alone hears of, and calls whose messages make no
// sense.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/net/connections.hpp"
#include "server/net/refusals.hpp"

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace osteon {

class AuditTrail;

// While it lives: a handshake that fails before any certificate is seen, as of who has none or speaks plain text, is
// noted as "tls". gRPC says it in its log alone, for the whole process and without an address; the rest of that log
// is dropped. The addresses noted are those of all connections of which no call has come. Any thread.
class HandshakeWatch {
 public:
  HandshakeWatch(RefusalCounts& refusals, Connections& connections);  // which outlive it
  ~HandshakeWatch();
  void note(const std::string& who, std::string_view said);
  // Takes down every one; it outlives this. Before the first connection.
  void set_trail(AuditTrail& trail) { trail_ = &trail; }
  HandshakeWatch(const HandshakeWatch&) = delete;
  HandshakeWatch& operator=(const HandshakeWatch&) = delete;

 private:
  RefusalCounts& refusals_;
  Connections& connections_;
  AuditTrail* trail_ = nullptr;  // null: nothing is taken down
};

// The trailing header of a call that the gate refused: its reason in one word. The gate has noted the call.
inline constexpr const char* kRefusalTrailer = "osteon-refusal";

// Logs why a call failed, with the paths that its caller is not told: by RefusalLog's limit. Any thread.
void log_failed_call(std::string_view why);

// Notes every call that ends since its message was malformed or nonsense ("request"), asked for too much ("quota"), or
// was not its caller's to make ("denied"), by the caller's address. Join and the gate note their own. `refusals` outlives the server.
[[nodiscard]] std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> refused_call_notes(
    RefusalCounts& refusals);

}  // namespace osteon
