// Placements of what is not round about its axis.
#pragma once
#include "common/geometry/pose.hpp"

namespace osteon {

// The tool's pose with its +z along `axis` and its +x as near to `across` as that allows; both not zero and not
// parallel.
[[nodiscard]] Pose pose_across(const Vec3& tip_mm, const Vec3& axis, const Vec3& across);

}  // namespace osteon
