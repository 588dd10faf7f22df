#include "common/tools/plan_offset.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon {
namespace {

// By both sine and cosine, so that it is exact near 0 and near a right angle.
double angle_between_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace

bool suits(AnnotationKind planned, ToolKind tool) {
  const bool saw = tool == ToolKind::oscillating_saw || tool == ToolKind::reciprocating_saw;
  return planned == (saw ? AnnotationKind::plane : AnnotationKind::axis);
}

PlanOffset plan_offset(const Annotation& planned, const Pose& pose_bone_tool) {
  const Vec3 direction = planned_direction(planned), tip_mm = pose_bone_tool.position_mm;
  const Vec3 beside = tip_mm - from_steps(planned.points.front());
  PlanOffset offset;
  if (planned.kind == AnnotationKind::plane) {
    // The sides of a blade are alike.
    const double turned_deg = angle_between_deg(pose_bone_tool.direction(Vec3::UnitY()), direction);
    offset.angle_deg = std::min(turned_deg, 180.0 - turned_deg);
    offset.beside_mm = beside.dot(direction);
    return offset;
  }
  offset.angle_deg = angle_between_deg(pose_bone_tool.direction(Vec3::UnitZ()), direction);
  offset.beside_mm = beside.cross(direction).norm();
  offset.depth_left_mm = (from_steps(planned.points.back()) - tip_mm).dot(direction);
  return offset;
}

}  // namespace osteon
