// Compact messages for a bone on its mount: how a user's hand loads it, and its pose.
#pragma once
#include "common/core/result.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "osteon/v1/link.pb.h"

namespace osteon::wire {

// Converts to the wire's steps; values are clamped to the range of its numbers. Energies are rounded down, so that
// rounding never creates energy.
[[nodiscard]] v1::MountLoad to_wire(const MountLoad& push);
[[nodiscard]] v1::MountPose to_wire(const MountPose& seen);

// Error invalid_input, naming the field, for what a correct peer never sends: missing numbers, no push_seq or seen_seq,
// a negative energy, a turn of more than pi, a lag of more than a minute.
[[nodiscard]] Result<MountLoad> from_wire(const v1::MountLoad& push);
[[nodiscard]] Result<MountPose> from_wire(const v1::MountPose& seen);

}  // namespace osteon::wire
