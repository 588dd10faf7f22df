#include "common/field/cut.hpp"

#include <cmath>

namespace osteon {

namespace {
constexpr double kRotationScale = 32767.0;
}

QuantisedPose quantise(const Pose& pose_bone_tool) {
  QuantisedPose quantised;
  for (int i = 0; i < 3; ++i)
    quantised.position[static_cast<std::size_t>(i)] =
        static_cast<std::int32_t>(std::lround(pose_bone_tool.position_mm[i] / kQuantum_mm));
  // q and −q are the same rotation. With w ≥ 0, equal poses have equal bytes.
  const double sign = pose_bone_tool.rotation.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector4d xyzw = sign * pose_bone_tool.rotation.normalized().coeffs();
  for (int i = 0; i < 4; ++i)
    quantised.rotation[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(std::lround(xyzw[i] * kRotationScale));
  return quantised;
}

Pose dequantise(const QuantisedPose& pose) {
  Pose result;
  result.position_mm = {pose.position[0] * kQuantum_mm, pose.position[1] * kQuantum_mm, pose.position[2] * kQuantum_mm};
  result.rotation =
      Eigen::Quaterniond(pose.rotation[3], pose.rotation[0], pose.rotation[1], pose.rotation[2]).normalized();
  return result;
}

}  // namespace osteon
