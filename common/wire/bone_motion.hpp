// A bone on its mount in few bytes: how a hand pushes it, and where it is.
#pragma once
#include "common/core/result.hpp"
#include "common/mechanics/passivity.hpp"
#include "osteon/v1/link.pb.h"

namespace osteon::wire {

// In the wire's steps, as far as its numbers go. Energies are rounded down, so that rounding never makes any.
[[nodiscard]] v1::BonePush to_wire(const BonePush& push);
[[nodiscard]] v1::BoneSeen to_wire(const BoneSeen& seen);

// Error invalid_input, naming the field, for what a correct peer never sends: numbers missing, no push_seq or seen_seq, energy
// below zero, a turn of more than pi, a lag of more than a minute.
[[nodiscard]] Result<BonePush> from_wire(const v1::BonePush& push);
[[nodiscard]] Result<BoneSeen> from_wire(const v1::BoneSeen& seen);

}  // namespace osteon::wire
