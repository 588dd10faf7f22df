// A cut, which is the only way to remove bone with a tool. It consists of integers, so that every program evaluates the
// same bytes.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/core/id.hpp"
#include "common/geometry/pose.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// pose_bone_tool in integers: position in kQuantum_mm, rotation as a quaternion (x, y, z, w) scaled by 32767. The
// kernel renormalises the quaternion, so its length need not be exactly one.
struct QuantisedPose {
  std::array<std::int32_t, 3> position{};
  std::array<std::int16_t, 4> rotation{0, 0, 0, 32767};
  friend auto operator<=>(const QuantisedPose&, const QuantisedPose&) = default;
};

[[nodiscard]] QuantisedPose quantise(const Pose& pose_bone_tool);
[[nodiscard]] Pose dequantise(const QuantisedPose& pose);

struct Cut {
  AuthorId author;
  std::uint64_t author_seq = 0;  // 1, 2, 3, … for each author
  std::uint64_t lease_epoch = 0;
  BodyId body;
  Digest tool;  // hash of the tool's definition, which defines the cutting body
  int level = 0;
  std::vector<QuantisedPose> path;  // at least one pose; the first is the last pose of the previous cut
  std::uint32_t spindle_rpm = 0;
  std::uint32_t path_us = 0;  // duration of this motion
  friend bool operator==(const Cut&, const Cut&) = default;
};

}  // namespace osteon
