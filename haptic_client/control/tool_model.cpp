#include "haptic_client/control/tool_model.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/mechanics/cutting_effects.hpp"
#include "common/mechanics/milling.hpp"

namespace osteon::haptic {
namespace {

bool is_saw(ToolKind kind) { return kind == ToolKind::oscillating_saw || kind == ToolKind::reciprocating_saw; }

// Points so near each other that bone does not slip between them where it matters: about three pitches.
int points_for(const Tool& tool, double pitch_mm) {
  constexpr int kFewest = 240, kMost = 800, kOfSaw = 320;
  if (tool.kind == ToolKind::drill) return kFewest;
  if (is_saw(tool.kind)) return kOfSaw;
  const Vec3 size = cutting_part(tool).bounds.size_mm();
  const double face_mm2 = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  return static_cast<int>(std::clamp(face_mm2 / (9.0 * pitch_mm * pitch_mm), double{kFewest}, double{kMost}));
}

// A saw's teeth are met at any place of their stroke: what touches is the box that they sweep, as in its cuts.
Tool at_stroke_ends(const Tool& tool) {
  Tool swept = tool;
  if (tool.kind == ToolKind::oscillating_saw) swept.width_mm += 2.0 * tool.pivot_mm * std::sin(0.5 * tool.swing_rad);
  if (tool.kind == ToolKind::reciprocating_saw) swept.cutting_length_mm += tool.stroke_mm;
  return swept;
}

Implicit touching_solid(const Tool& tool) {
  return is_saw(tool.kind) ? unite(tool_solid(tool), cut_solid(tool)) : tool_solid(tool);
}

std::vector<SamplePoint> points_of(const Tool& tool, int count) {
  std::vector<SamplePoint> points = sample_points(tool, count);
  if (!is_saw(tool.kind)) return points;
  std::erase_if(points, [](const SamplePoint& p) { return p.active; });
  const double forward_mm = tool.kind == ToolKind::reciprocating_saw ? 0.5 * tool.stroke_mm : 0.0;
  for (SamplePoint p : sample_points(at_stroke_ends(tool), count)) {
    if (!p.active) continue;
    p.position_mm.z() += forward_mm;
    points.push_back(p);
  }
  return points;
}

}  // namespace

bool feeds_along_axis(ToolKind kind) noexcept { return feeding(kind) == Feeding::along; }

Feeding feeding(ToolKind kind) noexcept {
  switch (kind) {
    case ToolKind::drill:
    case ToolKind::end_drill:
    case ToolKind::cylinder_reamer:
    case ToolKind::sphere_reamer:
    case ToolKind::outside_reamer:
    case ToolKind::pin:
    case ToolKind::screw:
    case ToolKind::broach:
      return Feeding::along;
    case ToolKind::oscillating_saw:
    case ToolKind::reciprocating_saw:
      return Feeding::in_plane;
    case ToolKind::round_burr:
    case ToolKind::barrel_burr:
    case ToolKind::contoured_burr:
    case ToolKind::mesh:
      return Feeding::any;
    default:
      return Feeding::none;
  }
}

ToolModel::ToolModel(const Tool& definition, double pitch_mm, double blunt, int points)
    : tool(definition),
      solid(touching_solid(definition)),
      feed(feeding(definition.kind)),
      axial(feed == Feeding::along),
      outline(definition, axial),
      cut_level(std::min(definition.cut_level, finest_level(pitch_mm))),
      fine_pitch_mm(level_pitch_mm(pitch_mm, cut_level)),
      wear(blunt) {
  inset = 0.5 * fine_pitch_mm + kQuantum_mm;
  // A broach's sides look forward by their taper only, and cut all the same.
  const bool sides_cut = tool.kind == ToolKind::broach;
  if (sides_cut) least_facing = 0.5 * std::sin(tool.taper_rad);
  for (const SamplePoint& p : points_of(tool, points > 0 ? points : points_for(tool, fine_pitch_mm))) {
    const double axis_mm = std::hypot(p.position_mm.x(), p.position_mm.y());
    // A screw's thread presses into the wall of its hole, which is its core: it does not hold it back.
    if (tool.kind == ToolKind::screw && p.position_mm.z() > -tool.cutting_length_mm &&
        axis_mm > 0.5 * tool.core_diameter_mm + kQuantum_mm)
      continue;
    const ContactPoint point{p.position_mm, p.position_mm + inset * p.inward, -p.inward, p.area_mm2, axis_mm};
    // A drill's flutes hold it in its hole but do not cut sideways, so only the point is active.
    const bool cuts = p.active && (!axial || point.outward.z() > (sides_cut ? least_facing : 0.1));
    (cuts ? active : passive).push_back(point);
    if (cuts) active_area_mm2 += point.area_mm2;
  }
  // The very point of what has one, which stands for no area: rings leave it out.
  if (point_height_mm(tool) > 0.0)
    active.push_back({Vec3::Zero(), {0, 0, -inset}, Vec3::UnitZ(), 0.0, 0.0});
  const MillingParams milling{.diameter_mm = tool.diameter_mm};
  contact = contact_set(active, passive, milling.pole_radius * 0.5 * tool.diameter_mm);
  OSTEON_CHECK(contact.groups() * kGroupPoints <= kMostContactPoints);
  // Far out, where the arm is not held up by the pole's; resistance goes with one over it.
  constexpr double kFar_mm = 1e3;
  for (std::size_t i = 0; i < strength.size(); ++i)
    strength[i] = static_cast<float>(
        kFar_mm * milling_resistance(milling, 1.0, kFar_mm, kMostDensity_g_cm3 * static_cast<double>(i) / kDensitySteps));
  law_tool = osteon::law_tool(tool);
  const Result<const ForceLaw*> own = choose_law(tool, {});
  law = own ? *own : &default_law(tool);
  spindle = motor_of(tool);
}

}  // namespace osteon::haptic
