#include "haptic_client/contact/tool_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/check.hpp"
#include "common/mechanics/cutting_effects.hpp"
#include "common/mechanics/milling.hpp"
#include "common/tools/spread_points.hpp"

namespace osteon::haptic {
namespace {

MillingParams milling_of(const Tool& tool) { return {.diameter_mm = tool.diameter_mm}; }

bool sides_cut(const Tool& tool) { return tool.kind == ToolKind::broach; }

bool is_saw(ToolKind kind) { return kind == ToolKind::oscillating_saw || kind == ToolKind::reciprocating_saw; }

// Number of points: so near each other that bone does not slip between them where it matters, about three pitches.
int points_for(const Tool& tool, double pitch_mm) {
  constexpr int kFewest = 240, kMost = 800, kOfSaw = 320;
  if (tool.kind == ToolKind::drill) return kFewest;
  if (is_saw(tool.kind)) return kOfSaw;
  const Vec3 size = cutting_part(tool).bounds.size_mm();
  const double face_mm2 = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  return static_cast<int>(std::clamp(face_mm2 / (9.0 * pitch_mm * pitch_mm), double{kFewest}, double{kMost}));
}

// A saw's teeth may be at any position of their stroke. So the box that they sweep touches, as in its cuts.
Tool at_stroke_ends(const Tool& tool) {
  Tool swept = tool;
  if (tool.kind == ToolKind::oscillating_saw) swept.width_mm += 2.0 * tool.pivot_mm * std::sin(0.5 * tool.swing_rad);
  if (tool.kind == ToolKind::reciprocating_saw) swept.cutting_length_mm += tool.stroke_mm;
  return swept;
}

// Z edges over a ring of radius r and width dr are Z dr long, on an area of 2 pi r dr. So each point of a turned tool
// gets a share of the cutting edge by its area divided by its distance from the axis. For a tool that goes along its
// axis, the area is as seen along it. All faces that point into the usual feed, wholly in bone, have the edge that
// LawTool counts.
void share_edge(const ToolModel& model, std::vector<ContactPoint>& active) {
  const Vec3 feed = model.axial ? Vec3::UnitZ() : Vec3::UnitX();
  double whole = 0.0;
  for (ContactPoint& point : active) {
    // A point on the axis represents a disc about it.
    const double arm_mm = std::max(point.axis_distance_mm, 0.5 * std::sqrt(point.area_mm2 / std::numbers::pi));
    if (arm_mm > 0.0) point.edge = point.area_mm2 / arm_mm * (model.axial ? point.outward.z() : 1.0);
    if (point.outward.dot(feed) >= model.least_facing) whole += point.edge;
  }
  for (ContactPoint& point : active) point.edge *= whole > 0.0 ? model.law_tool.edge_length_mm / whole : 0.0;
}

// A saw's teeth as points along its toothed edge over the whole stroke. Each point has the mean number of teeth there,
// because the blade reaches the ends of its stroke only part of the time. These points have no area; the faces have it.
void add_teeth(const ToolModel& model, std::vector<ContactPoint>& active) {
  constexpr double kApart_mm = 0.5;
  const Tool& tool = model.tool;
  const bool swings = tool.kind == ToolKind::oscillating_saw;
  // Half of the stroke and of the toothed edge, along the arc about the pivot or straight.
  const double a = 0.5 * model.law_tool.stroke_mm;
  const double b = swings ? tool.pivot_mm * std::asin(std::min(1.0, 0.5 * tool.width_mm / tool.pivot_mm))
                          : 0.5 * tool.cutting_length_mm;
  const int count = static_cast<int>(std::ceil(2.0 * (a + b) / kApart_mm));
  const double apart = 2.0 * (a + b) / count;
  for (int i = 0; i < count; ++i) {
    const double at = (i + 0.5) * apart - (a + b), angle = swings ? at / tool.pivot_mm : 0.0;
    const Vec3 outward = swings ? Vec3(std::sin(angle), 0, std::cos(angle)) : Vec3::UnitX();
    const Vec3 p = swings ? Vec3(tool.pivot_mm * (outward - Vec3::UnitZ()))
                          : Vec3(0.5 * tool.width_mm, 0, at - 0.5 * tool.cutting_length_mm);
    const double there = a > 0.0 ? (std::min(a, at + b) - std::max(-a, at - b)) / (2.0 * a) : 1.0;
    active.push_back({p, p - model.inset * outward, outward, 0.0, std::hypot(p.x(), p.y()),
                      there * apart / model.law_tool.tooth_pitch_mm});
  }
}

Implicit touching_solid(const Tool& tool) {
  return is_saw(tool.kind) ? unite(tool_solid(tool), cut_solid(tool)) : tool_solid(tool);
}

std::vector<SamplePoint> points_of(const Tool& tool, int count) {
  std::vector<SamplePoint> points = sample_points(tool, count);
  if (!is_saw(tool.kind)) return points;
  std::erase_if(points, [](const SamplePoint& p) { return p.active; });
  const double forward_mm = tool.kind == ToolKind::reciprocating_saw ? 0.5 * tool.stroke_mm : 0.0;
  for (SamplePoint p : active_points(at_stroke_ends(tool), count)) {
    p.position_mm.z() += forward_mm;
    points.push_back(p);
  }
  return points;
}

const ForceLaw& own_law(const Tool& tool) {
  const Result<const ForceLaw*> own = choose_law(tool);
  OSTEON_CHECK(own.has_value());
  return **own;
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
    : ToolModel(definition, pitch_mm, blunt, own_law(definition)) {
  make_points(points);
}

Result<ToolModel> ToolModel::make(const Tool& definition, double pitch_mm, double blunt, std::string_view law_name,
                                  ToolPoints when) {
  const Result<const ForceLaw*> chosen = choose_law(definition, law_name);
  if (!chosen) return tl::unexpected(chosen.error());
  ToolModel model(definition, pitch_mm, blunt, **chosen);
  if (when == ToolPoints::now) model.make_points();
  return model;
}

ToolModel::ToolModel(const Tool& definition, double pitch_mm, double blunt, const ForceLaw& by)
    : tool(definition),
      solid(touching_solid(definition)),
      feed(feeding(definition.kind)),
      axial(feed == Feeding::along),
      outline(definition, axial),
      cut_level(std::min(definition.cut_level, finest_level(pitch_mm))),
      fine_pitch_mm(level_pitch_mm(pitch_mm, cut_level)),
      wear(blunt),
      law(&by) {
  inset = 0.5 * fine_pitch_mm + kQuantum_mm;
  law_tool = osteon::law_tool(tool);
  // A broach's sides face forward by their taper only, but they cut.
  if (sides_cut(tool)) least_facing = 0.5 * std::sin(tool.taper_rad);
  const MillingParams milling = milling_of(tool);
  // Far out, where the pole does not limit the arm; resistance is proportional to one over the arm.
  constexpr double kFar_mm = 1e3;
  for (std::size_t i = 0; i < strength.size(); ++i)
    strength[i] =
        static_cast<float>(kFar_mm * milling_resistance(milling, 1.0, kFar_mm,
                                                        kMostDensity_g_cm3 * static_cast<double>(i) / kDensitySteps));
  spindle = motor_of(tool);
  if (is_saw(tool.kind)) stroke = tool.kind == ToolKind::oscillating_saw ? Vec3::UnitX() : Vec3::UnitZ();
}

void ToolModel::make_points(int points) {
  for (const SamplePoint& p : points_of(tool, points > 0 ? points : points_for(tool, fine_pitch_mm))) {
    const double axis_mm = std::hypot(p.position_mm.x(), p.position_mm.y());
    // A screw's thread presses into the wall of its hole, which is its core: it does not hold the screw back.
    if (tool.kind == ToolKind::screw && p.position_mm.z() > -tool.cutting_length_mm &&
        axis_mm > 0.5 * tool.core_diameter_mm + kQuantum_mm)
      continue;
    const ContactPoint point{p.position_mm, p.position_mm + inset * p.inward, -p.inward, p.area_mm2, axis_mm};
    // A drill's flutes hold it in its hole but do not cut sideways, so only the point is active.
    const bool cuts = p.active && (!axial || point.outward.z() > (sides_cut(tool) ? least_facing : 0.1));
    (cuts ? active : passive).push_back(point);
    if (cuts) active_area_mm2 += point.area_mm2;
  }
  if (is_saw(tool.kind))
    add_teeth(*this, active);
  else if (tool.kind != ToolKind::broach && tool.kind != ToolKind::mesh)
    share_edge(*this, active);
  // The tip of a tool with a point. It has no area, and rings leave it out.
  if (point_height_mm(tool) > 0.0) active.push_back({Vec3::Zero(), {0, 0, -inset}, Vec3::UnitZ(), 0.0, 0.0});
  contact = contact_set(active, passive, milling_of(tool).pole_radius * 0.5 * tool.diameter_mm);
  OSTEON_CHECK(contact.groups() * kGroupPoints <= kMostContactPoints);
}

}  // namespace osteon::haptic
