// How far a tool is from what a person has planned for it.
#pragma once
#include <optional>

#include "common/tools/annotation.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

struct PlanOffset {
  // Between the tool's axis and the planned one, 0 to 180 degrees; or between a saw blade and the planned plane, 0 to
  // 90 degrees.
  double angle_deg = 0;
  // Of the tip from the line of the axis; or from the plane, positive on the side to which planned_direction() points.
  double beside_mm = 0;
  std::optional<double> depth_left_mm = {};  // along the axis, to its target; negative beyond it. None: a plane.
};

// A plane suits saws, an axis all other tools.
[[nodiscard]] bool suits(AnnotationKind planned, ToolKind tool);

// `planned`: a checked axis or plane. `pose_bone_tool`: as the tool's frame is, with +z out of the tip and a blade's
// thickness along y. Bone frame.
[[nodiscard]] PlanOffset plan_offset(const Annotation& planned, const Pose& pose_bone_tool);

}  // namespace osteon
