#include "haptic_client/control/tool_model.hpp"

#include <algorithm>

namespace osteon::haptic {

ToolModel::ToolModel(const Tool& definition, double pitch_mm, double wear)
    : tool(definition),
      cut_level(std::min(definition.cut_level, finest_level(pitch_mm))),
      fine_pitch_mm(level_pitch_mm(pitch_mm, cut_level)) {
  constexpr int kActivePoints = 240;
  inset = 0.5 * fine_pitch_mm + kQuantum_mm;
  for (const SamplePoint& p : sample_points(tool, kActivePoints)) {
    const ContactPoint point{p.position_mm, p.position_mm + inset * p.inward, -p.inward, p.area_mm2,
                             std::hypot(p.position_mm.x(), p.position_mm.y())};
    // A drill's flutes hold it in its hole but do not cut sideways, so only the point is active.
    const bool cuts = p.active && (tool.kind != ToolKind::drill || point.outward.z() > 0.1);
    (cuts ? active : passive).push_back(point);
  }
  drilling.diameter_mm = milling.diameter_mm = tool.diameter_mm;
  drilling.wear = milling.wear = wear;
  if (tool.kind == ToolKind::drill) drilling.point_angle_rad = tool.point_angle_rad;
  spindle.full_rpm = tool.spindle_rpm;
}

}  // namespace osteon::haptic
