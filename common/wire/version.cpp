#include "common/wire/version.hpp"

#include <string>

namespace osteon::wire {
Result<void> check_protocol_version(std::uint32_t clients) {
  if (clients >= kOldestProtocolVersion && clients <= kProtocolVersion) return {};
  const std::string versions = "the client speaks protocol version " + std::to_string(clients) +
                               " and the server protocol version " + std::to_string(kProtocolVersion) + ", or " +
                               std::to_string(kOldestProtocolVersion);
  return failure(ErrorCode::unsupported,
                 versions + (clients < kOldestProtocolVersion
                                 ? "; install a newer Osteon where the client runs"
                                 : "; install a newer Osteon where the server runs, before the clients"));
}

// All versions before 4 know the first ten kinds.
std::uint32_t version_of(v1::SessionResponse::MessageCase kind) {
  return kind > v1::SessionResponse::kNoted ? 4 : kOldestProtocolVersion;
}

}  // namespace osteon::wire
