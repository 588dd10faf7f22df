// A bone on its mount in few bytes: how a hand pushes it, and where it is.
#pragma once
#include "common/core/result.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "osteon/v1/link.pb.h"

namespace osteon::wire {

// In the wire's steps, as far as its numbers go. Energies are rounded down, so that rounding never makes any.
[[nodiscard]] v1::MountLoad to_wire(const MountLoad& push);
[[nodiscard]] v1::MountPose to_wire(const MountPose& seen);

// Error invalid_input, naming the field, for what a correct peer never sends: numbers missing, no push_seq or seen_seq,
// energy below zero, a turn of more than pi, a lag of more than a minute.
[[nodiscard]] Result<MountLoad> from_wire(const v1::MountLoad& push);
[[nodiscard]] Result<MountPose> from_wire(const v1::MountPose& seen);

}  // namespace osteon::wire
