// What is refused beside the gate: handshakes that fail, which gRPC alone hears of, and calls whose messages make no
// sense.
#pragma once
#include <memory>
#include <vector>

#include "server/net/refusals.hpp"

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace osteon {

// While it lives: a handshake that fails, as of who has no certificate or speaks plain text, is noted as "tls". gRPC
// says it in its log alone, for the whole process and without an address; the rest of that log is dropped. Any thread.
class HandshakeWatch {
 public:
  explicit HandshakeWatch(RefusalCounts& refusals);  // which outlives it
  ~HandshakeWatch();
  HandshakeWatch(const HandshakeWatch&) = delete;
  HandshakeWatch& operator=(const HandshakeWatch&) = delete;

 private:
  RefusalCounts& refusals_;
};

// Notes every call that ends since its message was malformed or nonsense ("request"), asked for too much ("quota"), or
// was not its caller's to make ("denied"), by the caller's address. Join notes its own. `refusals` outlives the server.
[[nodiscard]] std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> refused_call_notes(
    RefusalCounts& refusals);

}  // namespace osteon
