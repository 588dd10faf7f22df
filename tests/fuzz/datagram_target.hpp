// Datagrams as a fuzz target: any bytes at the opener, and the same bytes as what a peer with the key says.
#pragma once
#include <functional>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// What stands above the opener: takes any plain bytes of an authentic datagram.
using PlainTarget = std::function<void(std::span<const std::uint8_t>)>;

// `above`: what the plain bytes go on to; none: they are only compared. `plain_seeds`: valid ones, for it.
[[nodiscard]] Target datagram_target(PlainTarget above = {}, const std::vector<Bytes>& plain_seeds = {});

}  // namespace osteon::fuzz
