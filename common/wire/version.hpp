// Which protocol versions are compatible: a server accepts clients of its own version and of the one before.
#pragma once
#include <cstdint>
#include <optional>

#include "common/core/result.hpp"
#include "osteon/v1/cutting.pb.h"

namespace osteon::wire {

// Version of the protocol of this build, and the oldest client version that its server accepts.
inline constexpr std::uint32_t kProtocolVersion = 4;
inline constexpr std::uint32_t kOldestProtocolVersion = kProtocolVersion - 1;

// Error unsupported: a sentence with both versions and the remedy.
[[nodiscard]] Result<void> check_protocol_version(std::uint32_t clients);

// The message as a session of that version receives it. Nothing: it is not sent at all. A version treats messages of
// unknown kinds as a fault. So an event of an unknown kind, which has a sequence number, is sent as an event that
// changes nothing.
[[nodiscard]] std::optional<v1::SessionResponse> entry_for_version(std::uint32_t version,
                                                                   const v1::SessionResponse& row);

}  // namespace osteon::wire
