// Fuzz target for datagrams. It gives any bytes to the opener, and the same bytes as plain text from a peer with the
// key.
#pragma once
#include <functional>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// The layer above the opener. It takes any plain bytes of an authentic datagram.
using PlainTarget = std::function<void(std::span<const std::uint8_t>)>;

// `above`: receives the plain bytes. If empty, the bytes are only compared. `plain_seeds`: valid inputs for `above`.
[[nodiscard]] Target datagram_target(PlainTarget above = {}, const std::vector<Bytes>& plain_seeds = {});

}  // namespace osteon::fuzz
