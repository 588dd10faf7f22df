// Which versions of the protocol speak with each other: a server takes clients of its own and of the one before.
#pragma once
#include <cstdint>
#include <optional>

#include "common/core/result.hpp"
#include "osteon/v1/cutting.pb.h"

namespace osteon::wire {

// Version of the protocol that this build speaks, and the oldest that its server takes from clients.
inline constexpr std::uint32_t kProtocolVersion = 4;
inline constexpr std::uint32_t kOldestProtocolVersion = kProtocolVersion - 1;

// Error unsupported: a sentence with both versions and the remedy.
[[nodiscard]] Result<void> check_protocol_version(std::uint32_t clients);

// The row as a session of that version is sent it. Nothing: it is not sent at all. A version knows the kinds of
// messages that it was made with and takes others for a fault; what has a place in the room's order is told to it as an
// event that leaves all as it is.
[[nodiscard]] std::optional<v1::SessionResponse> row_in(std::uint32_t version, const v1::SessionResponse& row);

}  // namespace osteon::wire
