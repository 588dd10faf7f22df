#include "haptic_client/control/tool_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace osteon::haptic {

namespace {

SweptOutline outline_of(const Tool& tool) {
  const CutBody body = tool.cut_body();
  SweptOutline outline;
  const auto add = [&](double r, double z, double offset_mm) {
    outline.planes[static_cast<std::size_t>(outline.count++)] = {r, z, offset_mm};
  };
  double widest = 0.0, narrowest = std::numeric_limits<double>::max();
  const std::size_t corners = std::min(body.profile.size(), kMostProfileCorners);
  for (std::size_t i = 0; i < corners; ++i) {
    const ProfileCorner a = body.profile[i], b = body.profile[(i + 1) % corners];
    widest = std::max(widest, kQuantum_mm * a.r);
    narrowest = std::min(narrowest, kQuantum_mm * a.r);
    const double er = kQuantum_mm * (b.r - a.r), ez = kQuantum_mm * (b.z - a.z), length = std::hypot(er, ez);
    if (!(length > 0.0) || !(-er > 1e-9)) continue;  // looks back or to the side
    add(ez / length, -er / length, (ez * kQuantum_mm * a.r - er * kQuantum_mm * a.z) / length);
  }
  if (corners == 0) return outline;
  add(1.0, 0.0, widest);
  if (narrowest > 0.0) add(-1.0, 0.0, -narrowest);  // hollow: what stands in the middle is left
  add(0.0, -1.0, tool.cutting_length_mm);
  outline.dome_mm = kQuantum_mm * body.dome;
  return outline;
}

}  // namespace

double SweptOutline::distance_mm(const Vec3& p) const noexcept {
  const double r = std::sqrt(p.x() * p.x() + p.y() * p.y());
  double distance = -std::numeric_limits<double>::max();
  for (int i = 0; i < count; ++i) {
    const Plane& plane = planes[static_cast<std::size_t>(i)];
    distance = std::max(distance, plane.r * r + plane.z * p.z() - plane.offset_mm);
  }
  if (dome_mm > 0.0 && p.z() > -dome_mm) distance = std::max(distance, std::hypot(r, p.z() + dome_mm) - dome_mm);
  return distance;
}

bool feeds_along_axis(ToolKind kind) noexcept {
  return kind == ToolKind::drill || kind == ToolKind::end_drill || kind == ToolKind::cylinder_reamer ||
         kind == ToolKind::sphere_reamer || kind == ToolKind::outside_reamer || kind == ToolKind::pin || kind == ToolKind::screw;
}

ToolModel::ToolModel(const Tool& definition, double pitch_mm, double wear)
    : tool(definition),
      solid(tool_solid(definition)),
      axial(feeds_along_axis(definition.kind)),
      cut_level(std::min(definition.cut_level, finest_level(pitch_mm))),
      fine_pitch_mm(level_pitch_mm(pitch_mm, cut_level)) {
  constexpr int kActivePoints = 240;
  inset = 0.5 * fine_pitch_mm + kQuantum_mm;
  for (const SamplePoint& p : sample_points(tool, kActivePoints)) {
    // A screw's thread presses into the wall of its hole, which is its core: it does not hold it back.
    if (tool.kind == ToolKind::screw && p.position_mm.z() > -tool.cutting_length_mm &&
        std::hypot(p.position_mm.x(), p.position_mm.y()) > 0.5 * tool.core_diameter_mm + kQuantum_mm)
      continue;
    const ContactPoint point{p.position_mm, p.position_mm + inset * p.inward, -p.inward, p.area_mm2,
                             std::hypot(p.position_mm.x(), p.position_mm.y())};
    // A drill's flutes hold it in its hole but do not cut sideways, so only the point is active.
    const bool cuts = p.active && (!axial || point.outward.z() > 0.1);
    (cuts ? active : passive).push_back(point);
  }
  drilling.diameter_mm = milling.diameter_mm = tool.diameter_mm;
  drilling.wear = milling.wear = wear;
  if (axial) {
    outline = outline_of(tool);
    if (tool.kind == ToolKind::screw) drilling.diameter_mm = tool.core_diameter_mm;  // its thread is not part of the law
    drilling.point_angle_rad = tool.point_angle_rad > 0.0 ? tool.point_angle_rad : std::numbers::pi;  // else flat or round
  }
  spindle.full_rpm = tool.spindle_rpm;
}

}  // namespace osteon::haptic
