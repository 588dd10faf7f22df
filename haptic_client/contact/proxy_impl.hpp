// Constants and small functions that the two sources of Proxy share: proxy.cpp moves the tool, cutting_force.cpp
// computes the force of what it removes.
#pragma once
#include <cstddef>
#include <cstdint>

#include "haptic_client/contact/proxy.hpp"

namespace osteon::haptic {

// Free travel along a direction of cutting in one tick: 2 m/s. The tool follows a faster device a little later.
inline constexpr double kMostTravel_mm = 2.0;
inline constexpr int kMostSubSteps = 24;     // of motion that cuts
inline constexpr int kMostTravelSteps = 10;  // of motion that does not
inline constexpr int kMostTries = 12;        // poses tried in a tick; a wedged tool gets there a little later
inline constexpr double kNothing_mm = 1e-6;
// Depth in bone at which a point still counts as outside: the error of a linear step, far below what a hand feels.
inline constexpr double kSkin_mm = 1e-4;
inline constexpr double kNoise_mm = 1e-5;  // of distances in floats
inline constexpr double kFlatField = 0.3;  // a shorter gradient means nothing: samples are clipped there
// Sideways force that a drill's point holds on a slope, per newton along its axis [A]: 17 degrees. Beyond it skates.
inline constexpr double kBite = 0.3, kSteepest = 3.0, kWholePoint = 0.9;
inline constexpr double kSkiveSpeed_mm_per_s = 30.0;
inline constexpr double kMostSkive_mm = 3.0;
// Stiffness with which a hand, and the other beside it, hold the point against that. [A]
inline constexpr double kHand_n_per_mm = 20.0;
// Play of a tool in its own hole, in insets: points that stand apart around it permit a little more.
inline constexpr double kPlay = 1.5;
inline constexpr std::int32_t kNoSweep = -1;
inline constexpr double kDrawnOut_mm = 1.0;  // in a tick, of a tool that is locked in bone

inline const ContactPoint& point_at(const ToolModel& model, int i) noexcept {
  const int first = model.contact.first_passive();
  return i < first ? model.active[static_cast<std::size_t>(i)] : model.passive[static_cast<std::size_t>(i - first)];
}
inline bool is_real(const ToolModel& model, int i) noexcept {
  const int first = model.contact.first_passive();
  return i < first ? i < model.contact.active : i - first < model.contact.passive;
}
// Walls no wider than the cutting part follow a tool along its axis; wider walls meet bone.
inline bool walls_meet_bone(const ToolModel& model) noexcept {
  return !model.axial || model.tool.shank_diameter_mm > model.tool.diameter_mm ||
         model.tool.kind == ToolKind::outside_reamer;
}
inline bool skives(ToolKind kind) noexcept {
  return kind == ToolKind::drill || kind == ToolKind::pin || kind == ToolKind::end_drill;
}

// The hole's axis after the tool in it has moved: two points of the axis, each with this much play across it.
inline Pose with_play(const Pose& hole, const Pose& tool, double arm_mm, double play_mm) noexcept {
  const Vec3 axis = tool.direction(Vec3::UnitZ());
  const auto followed = [&](const Vec3& from, const Vec3& to) {
    const double along_mm = (to - from).dot(axis);
    const Vec3 aside_mm = to - from - along_mm * axis;
    const double size_mm = aside_mm.norm();
    const double share = size_mm > play_mm ? 1.0 - play_mm / size_mm : 0.0;
    return Vec3(from + along_mm * axis + share * aside_mm);
  };
  const Vec3 behind(0, 0, -arm_mm), tip = followed(hole.position_mm, tool.position_mm);
  const Vec3 along = tip - followed(hole.point(behind), tool.point(behind));
  return {tip, (rotation_between(axis, along) * tool.rotation).normalized()};
}

// A group's points, moved out of the tool along their normals. Tool frame.
inline void places_of(const ContactSet& set, int group, float lift_mm, Lanes (&p)[3]) noexcept {
  const auto from = static_cast<std::size_t>(group * kGroupPoints);
  for (std::size_t i = 0; i < kGroupPoints; ++i) {
    p[0][i] = set.x[from + i] + lift_mm * set.nx[from + i];
    p[1][i] = set.y[from + i] + lift_mm * set.ny[from + i];
    p[2][i] = set.z[from + i] + lift_mm * set.nz[from + i];
  }
}

}  // namespace osteon::haptic
