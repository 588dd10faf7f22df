// Which room a call is to. For the sources of the services alone: gRPC stays out of headers.
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "server/net/out_stream.inl"
#include "server/net/rooms.hpp"

namespace osteon {

// By the call's metadata "osteon-room-bin"; without it, the only one that is open.
inline Result<std::shared_ptr<OpenRoom>> called_room(const Rooms& rooms, const grpc::CallbackServerContext& context) {
  const auto named = context.client_metadata().find("osteon-room-bin");
  return rooms.find(named == context.client_metadata().end() ? std::string() : std::string(named->second.data(), named->second.size()));
}

inline Status status_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::invalid_input: return invalid(error.message);
    case ErrorCode::not_found: return {StatusCode::NOT_FOUND, error.message};
    case ErrorCode::denied: return {StatusCode::PERMISSION_DENIED, error.message};
    case ErrorCode::exists: return {StatusCode::ALREADY_EXISTS, error.message};
    case ErrorCode::unavailable:
    case ErrorCode::unsupported: return {StatusCode::FAILED_PRECONDITION, error.message};
    default: return {StatusCode::INTERNAL, error.message};
  }
}

}  // namespace osteon
