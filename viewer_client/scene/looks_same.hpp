// Whether two states of a tool look the same, in the picture and in its gauges.
#pragma once
#include <cmath>

#include "common/mechanics/cutting_state.hpp"

namespace osteon {

// A hand at rest trembles by less than this. It is a twentieth of a pixel or less in every picture of a bone.
inline constexpr double kLeastMotion_mm = 0.005;
// The longest tool that is drawn. A turn moves its end by this times the angle.
inline constexpr double kLongestTool_mm = 200.0;

[[nodiscard]] inline bool looks_same(const Pose& a, const Pose& b) {
  return (a.position_mm - b.position_mm).norm() <= kLeastMotion_mm &&
         a.rotation.angularDistance(b.rotation) * kLongestTool_mm <= kLeastMotion_mm;
}

// Gauges look the same within half of the last digit that they show.
[[nodiscard]] inline bool looks_same(const CuttingState& a, const CuttingState& b) {
  const auto within = [](double x, double y, double half_digit) { return std::abs(x - y) <= half_digit; };
  return a.author == b.author && a.tool_name == b.tool_name && a.phase == b.phase && a.on_metal == b.on_metal &&
         a.irrigation == b.irrigation && a.suction == b.suction && within(a.flutes_full, b.flutes_full, 0.005) &&
         looks_same(a.pose_bone_tool, b.pose_bone_tool) && looks_same(a.pose_bone_device, b.pose_bone_device) &&
         within(a.spindle_rpm, b.spindle_rpm, 0.5) && within(a.depth_mm, b.depth_mm, 0.05) &&
         (a.force_physical_N - b.force_physical_N).norm() <= 0.05 && within(a.force_hand_N, b.force_hand_N, 0.05) &&
         within(a.device_holds_N, b.device_holds_N, 0.05) && within(a.engaged_fraction, b.engaged_fraction, 0.005) &&
         within(a.density_g_cm3, b.density_g_cm3, 0.005);
}

}  // namespace osteon
