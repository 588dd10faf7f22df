// Which protocol versions are compatible: a server accepts clients of its own version and of the one before.
#pragma once
#include <cstdint>

#include "common/core/result.hpp"
#include "osteon/v1/cutting.pb.h"

namespace osteon::wire {

// Version of the protocol of this build, and the oldest client version that its server accepts.
inline constexpr std::uint32_t kProtocolVersion = 4;
inline constexpr std::uint32_t kOldestProtocolVersion = kProtocolVersion - 1;

// Error unsupported: a sentence with both versions and the remedy.
[[nodiscard]] Result<void> check_protocol_version(std::uint32_t clients);

// The oldest version that knows this kind of message, at least kOldestProtocolVersion. A version treats messages of
// unknown kinds as a fault, so a session of an older version must not get one.
[[nodiscard]] std::uint32_t version_of(v1::SessionResponse::MessageCase kind);

}  // namespace osteon::wire
