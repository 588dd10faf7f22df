// Poses of tools that are not rotationally symmetric.
#pragma once
#include "common/geometry/pose.hpp"

namespace osteon {

// The tool's pose with its +z along `axis` and its +x as near to `across` as that allows. Both must be non-zero and not
// parallel.
[[nodiscard]] Pose pose_across(const Vec3& tip_mm, const Vec3& axis, const Vec3& across);

}  // namespace osteon
