#include "common/tools/tool_solid.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/core/check.hpp"
#include "common/tools/guide.hpp"

namespace osteon {
namespace {

using std::numbers::pi;
// Arcs become chords. With these numbers no builtin tool differs from its arc by more than 0.01 mm (0.02 mm for tools
// that cut at the case's own pitch). This is well below the resolution of the tool's level.
constexpr int kBarrelChords = 8, kEndChords = 7, kEdgeChords = 6, kTipChords = 15;
// Openings are extended this far beyond their ends, so that no skin is left there.
constexpr double kOver_mm = 1.0;

double in_quanta(double mm) { return static_cast<double>(std::lround(mm / kQuantum_mm)) * kQuantum_mm; }

bool bores(const Tool& tool) {
  return tool.kind == ToolKind::drill || tool.kind == ToolKind::end_drill || tool.kind == ToolKind::pin ||
         tool.kind == ToolKind::screw;
}

// The radius of the part of a drill, pin or screw that goes into bone. A screw's thread runs around its core.
double bore_radius_mm(const Tool& tool) {
  return 0.5 * (tool.kind == ToolKind::screw ? tool.core_diameter_mm : tool.diameter_mm);
}

// A cylinder with a conical point, from the tip backwards.
std::vector<Corner> pointed(double radius, double height, double length) {
  if (height >= length) return {{0, 0}, {0, -length}, {radius * length / height, -length}};
  return {{0, 0}, {0, -length}, {radius, -length}, {radius, -height}};
}

std::vector<Corner> barrel_outline(const Tool& tool) {
  const double half = 0.5 * tool.cutting_length_mm, bulge = tool.corner_mm, radius = 0.5 * tool.diameter_mm;
  const double angle = std::asin(std::min(1.0, half / bulge));
  std::vector<Corner> corners{{0, 0}, {0, -2.0 * half}};
  for (int i = 0; i <= kBarrelChords; ++i) {
    const double a = angle * (2.0 * i / kBarrelChords - 1.0);
    // The ends are exact, whatever the rounding of sine and arc sine.
    const double z = i == 0 ? -2.0 * half : i == kBarrelChords ? 0.0 : bulge * std::sin(a) - half;
    corners.push_back({radius - bulge * (1.0 - std::cos(a)), z});
  }
  return corners;
}

std::vector<Corner> contoured_outline(const Tool& tool) {
  const double end = end_radius_mm(tool);
  std::vector<Corner> corners{{0, 0}, {0, -tool.cutting_length_mm}, {0.5 * tool.diameter_mm, -tool.cutting_length_mm}};
  for (int i = 0; i < kEndChords; ++i) {
    const double a = tool.taper_rad + (0.5 * pi - tool.taper_rad) * i / kEndChords;
    corners.push_back({end * std::cos(a), end * std::sin(a) - end});
  }
  return corners;
}

std::vector<Corner> canal_reamer_outline(const Tool& tool) {
  const double radius = 0.5 * tool.diameter_mm, edge = tool.corner_mm;
  std::vector<Corner> corners{{0, 0}, {0, -tool.cutting_length_mm}, {radius, -tool.cutting_length_mm}};
  if (edge <= 0.0) corners.push_back({radius, 0});
  for (int i = 0; edge > 0.0 && i <= kEdgeChords; ++i) {
    const double a = 0.5 * pi * i / kEdgeChords;
    corners.push_back({radius - edge + edge * std::cos(a), i == kEdgeChords ? 0.0 : edge * std::sin(a) - edge});
  }
  return corners;
}

// The toothed end of an oscillating blade at all angles up to half a `swing` to either side. Its tooth line is an arc
// about the pivot, and a side reaches farthest out at the end of the stroke.
std::vector<HalfSpace> swung_blade(const Tool& tool, double swing_rad, double thickness_mm) {
  const double pivot = tool.pivot_mm, half_width = 0.5 * tool.width_mm, half_swing = 0.5 * swing_rad;
  const double reach = std::asin(std::min(1.0, half_width / pivot)) + half_swing;
  std::vector<HalfSpace> faces;
  for (int i = 0; i < kTipChords; ++i) {
    const double a = reach * ((2.0 * i + 1.0) / kTipChords - 1.0);
    // Tangent to the arc of radius `pivot` about (0, 0, -pivot).
    faces.push_back({{std::sin(a), 0, std::cos(a)}, pivot * (1.0 - std::cos(a))});
  }
  for (const double side : {1.0, -1.0})
    faces.push_back(
        {{side * std::cos(half_swing), 0, -std::sin(half_swing)}, half_width + pivot * std::sin(half_swing)});
  for (const double side : {1.0, -1.0}) faces.push_back({{0, side, 0}, 0.5 * thickness_mm});
  faces.push_back({{0, 0, -1}, tool.cutting_length_mm});
  return faces;
}

std::vector<HalfSpace> straight_blade(const Tool& tool, double stroke_mm, double thickness_mm) {
  std::vector<HalfSpace> faces;
  for (const double side : {1.0, -1.0}) {
    faces.push_back({{side, 0, 0}, 0.5 * tool.width_mm});
    faces.push_back({{0, side, 0}, 0.5 * thickness_mm});
  }
  faces.push_back({{0, 0, 1}, 0.5 * stroke_mm});
  faces.push_back({{0, 0, -1}, tool.cutting_length_mm + 0.5 * stroke_mm});
  return faces;
}

// Width and thickness are those of the upper end. The sides taper to the tip, and their edges are bevelled.
std::vector<HalfSpace> tapered_stem(const Tool& tool) {
  const double slope = std::tan(tool.taper_rad), length = tool.cutting_length_mm;
  const double half_x = 0.5 * tool.width_mm - length * slope, half_y = 0.5 * tool.thickness_mm - length * slope;
  std::vector<HalfSpace> faces{{{0, 0, 1}, 0.0}, {{0, 0, -1}, length}};
  const auto add = [&](double x, double y, double offset) {
    const Vec3 across(x, y, (std::abs(x) + std::abs(y)) * slope);
    faces.push_back({across.normalized(), offset / across.norm()});
  };
  for (const double side : {1.0, -1.0}) {
    add(side, 0, half_x);
    add(0, side, half_y);
  }
  if (tool.corner_mm > 0.0)
    for (const double x : {1.0, -1.0})
      for (const double y : {1.0, -1.0}) add(x, y, half_x + half_y - tool.corner_mm);
  return faces;
}

double kerf_mm(const Tool& tool) { return tool.thickness_mm + tool.set_mm; }

// A ridge of triangular section that winds around the core, from the tip to the head. In a meridian plane it is a comb
// of triangles. Around the axis it shifts by one pitch per turn, so its distance is divided by the factor that this
// adds.
Implicit thread(const Tool& tool) {
  const double core = 0.5 * tool.core_diameter_mm, crest = 0.5 * tool.diameter_mm, pitch = tool.thread_pitch_mm;
  const double root = 0.9 * core, depth = crest - root, half_foot = 0.4 * pitch;
  const double slant = std::hypot(depth, half_foot), shift = pitch / (2.0 * pi * root);
  const double slower = 1.0 / std::sqrt(1.0 + shift * shift);
  const Implicit within = turned(pointed(crest, point_height_mm(tool) * crest / core, tool.cutting_length_mm));
  const auto distance = [=](const Vec3& p) {
    const double r = std::sqrt(p.x() * p.x() + p.y() * p.y());
    const double turn = p.z() / pitch - std::atan2(p.y(), p.x()) / (2.0 * pi);
    const double u = std::abs(turn - std::round(turn)) * pitch;
    // The flank from the foot (half_foot, root) to the crest (0, crest). Below the root there is only the core.
    const double flank = (u * depth + (r - crest) * half_foot) / slant;
    return std::max({slower * flank, root - r, within(p)});
  };
  return {distance, within.bounds};
}

Implicit without_openings(const Tool& guide, Implicit body) {
  const GuideShape shape = guide_shape(guide);
  const auto drill_hole = [&](const GuideBore& bore) {
    const Pose along = pose_along(bore.entry_mm, bore.direction);
    body = subtract(std::move(body),
                    placed(cylinder(0.5 * bore.diameter_mm, -kOver_mm, bore.length_mm + kOver_mm), along));
  };
  for (const GuideBore& bore : shape.bores) drill_hole(bore);
  for (const GuideBore& bore : shape.pin_holes) drill_hole(bore);
  for (const GuideSlot& slot : shape.slots) {
    Eigen::Matrix3d axes;
    axes << slot.normal.cross(slot.direction), slot.normal, slot.direction;
    const Vec3 half(0.5 * slot.width_mm, 0.5 * slot.height_mm, 0.0);
    // A slanted slot extends beyond both faces by its height, so that it opens completely.
    const double over = kOver_mm + 2.0 * slot.height_mm;
    Vec3 low = -half, high = half;
    low.z() = -over;
    high.z() = slot.depth_mm + over;
    body = subtract(std::move(body), placed(cuboid({low, high}), {slot.entry_mm, Eigen::Quaterniond(axes)}));
  }
  return body;
}

Implicit sampled_solid(const std::shared_ptr<const SampledDistance>& mesh) {
  const double pitch = mesh->pitch * kQuantum_mm;
  const Box box{position_mm(mesh->box.min, pitch), position_mm(mesh->box.max, pitch)};
  // Trilinear inside the lattice. Outside, the distance to the lattice is added to the value at its edge.
  const auto distance = [mesh, pitch, box](const Vec3& p) {
    const Vec3 nearest = p.cwiseMax(box.min_mm).cwiseMin(box.max_mm);
    const Coord dims = mesh->box.dims();
    const Vec3 place = (nearest - box.min_mm) / pitch;
    std::int32_t base[3];
    double t[3];
    const std::int32_t size[3] = {dims.x, dims.y, dims.z};
    for (int k = 0; k < 3; ++k) {
      base[k] = std::clamp(static_cast<std::int32_t>(place[k]), 0, size[k] - 2);
      t[k] = place[k] - base[k];
    }
    double value = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const int i = corner >> 2, j = (corner >> 1) & 1, k = corner & 1;
      const auto index = (static_cast<std::size_t>(base[0] + i) * static_cast<std::size_t>(size[1]) +
                          static_cast<std::size_t>(base[1] + j)) *
                             static_cast<std::size_t>(size[2]) +
                         static_cast<std::size_t>(base[2] + k);
      value += mesh->values[index] * kQuantum_mm * (i ? t[0] : 1.0 - t[0]) * (j ? t[1] : 1.0 - t[1]) *
               (k ? t[2] : 1.0 - t[2]);
    }
    return value + (p - nearest).norm();
  };
  return {distance, box};
}

Implicit of_outline(const CutOutline& outline) {
  if (outline.kind == CutKind::ball) return ball({0, 0, -outline.radius_mm}, outline.radius_mm);
  if (outline.kind == CutKind::hull) return convex(outline.planes);
  if (outline.dome_mm > 0.0) return intersect(turned(outline.profile), ball({0, 0, -outline.dome_mm}, outline.dome_mm));
  return turned(outline.profile);
}

// Straight behind the cutting part.
Implicit shank(const Tool& tool) {
  return cylinder(0.5 * tool.shank_diameter_mm, -tool.reach_mm(), shank_start_mm(tool));
}

}  // namespace

double point_height_mm(const Tool& tool) {
  return tool.point_angle_rad > 0.0 ? bore_radius_mm(tool) / std::tan(0.5 * tool.point_angle_rad) : 0.0;
}

double shank_start_mm(const Tool& tool) {
  if (tool.kind != ToolKind::round_burr) return -tool.cutting_length_mm;
  const double radius = 0.5 * tool.diameter_mm, neck = std::min(radius, 0.5 * tool.shank_diameter_mm);
  return -radius - std::sqrt(radius * radius - neck * neck);
}

double end_radius_mm(const Tool& tool) {
  const double t = tool.taper_rad;
  return (0.5 * tool.diameter_mm - tool.cutting_length_mm * std::tan(t)) /
         (std::cos(t) - (1.0 - std::sin(t)) * std::tan(t));
}

double tooth_line_drop_mm(const Tool& tool) {
  return tool.pivot_mm *
         (1.0 - std::cos(std::asin(std::min(1.0, 0.5 * tool.width_mm / tool.pivot_mm)) + 0.5 * tool.swing_rad));
}

CutOutline cut_outline(const Tool& tool) {
  CutOutline outline;
  outline.kind = CutKind::turned;
  if (bores(tool)) {
    // Only the lips and a land of one radius behind them cut. The rest runs in the hole that these have made.
    const double radius = bore_radius_mm(tool), height = point_height_mm(tool);
    outline.profile = pointed(radius, height, std::min(tool.cutting_length_mm, in_quanta(height) + in_quanta(radius)));
    return outline;
  }
  switch (tool.kind) {
    case ToolKind::round_burr:
      outline.kind = CutKind::ball;
      outline.radius_mm = 0.5 * tool.diameter_mm;
      break;
    case ToolKind::barrel_burr:
      outline.profile = barrel_outline(tool);
      break;
    case ToolKind::contoured_burr:
      outline.profile = contoured_outline(tool);
      break;
    case ToolKind::sphere_reamer:
      outline.dome_mm = 0.5 * tool.diameter_mm;
      outline.profile = pointed(outline.dome_mm, 0.0, tool.cutting_length_mm);
      break;
    case ToolKind::cylinder_reamer:
      outline.profile = canal_reamer_outline(tool);
      break;
    case ToolKind::outside_reamer: {
      const double inner = 0.5 * tool.bore_mm, outer = 0.5 * tool.diameter_mm, length = tool.cutting_length_mm;
      outline.profile = {{inner, 0}, {inner, -length}, {outer, -length}, {outer, 0}};
      break;
    }
    case ToolKind::oscillating_saw:
      outline.kind = CutKind::hull;
      outline.planes = swung_blade(tool, tool.swing_rad, kerf_mm(tool));
      break;
    case ToolKind::reciprocating_saw:
      outline.kind = CutKind::hull;
      outline.planes = straight_blade(tool, tool.stroke_mm, kerf_mm(tool));
      break;
    case ToolKind::broach:
      outline.kind = CutKind::hull;
      outline.planes = tapered_stem(tool);
      break;
    case ToolKind::mesh:
      outline.kind = CutKind::sampled;
      break;
    default:
      outline.kind = CutKind::none;
      break;
  }
  return outline;
}

Implicit cut_solid(const Tool& tool) {
  OSTEON_CHECK(tool.cuts());
  return tool.kind == ToolKind::mesh ? sampled_solid(tool.mesh) : of_outline(cut_outline(tool));
}

Implicit cutting_part(const Tool& tool) {
  const double length = tool.cutting_length_mm, half = 0.5 * tool.diameter_mm;
  switch (tool.kind) {
    case ToolKind::drill:
    case ToolKind::end_drill:
    case ToolKind::pin:
      return turned(pointed(half, point_height_mm(tool), length));
    case ToolKind::screw:
      return unite(turned(pointed(0.5 * tool.core_diameter_mm, point_height_mm(tool), length)), thread(tool));
    case ToolKind::oscillating_saw:
      return convex(swung_blade(tool, 0.0, kerf_mm(tool)));
    case ToolKind::reciprocating_saw:
      return convex(straight_blade(tool, 0.0, kerf_mm(tool)));
    case ToolKind::drill_sleeve:
      return without_openings(tool, cylinder(half, -length, 0));
    case ToolKind::distal_block:
    case ToolKind::four_in_one_block: {
      const double x = 0.5 * tool.width_mm, y = 0.5 * tool.thickness_mm;
      return without_openings(tool, cuboid({Vec3(-x, -y, -length), Vec3(x, y, 0)}));
    }
    case ToolKind::trial_cup: {
      const Vec3 centre(0, 0, -half);
      const Implicit outside =
          intersect(ball(centre, half), cuboid({Vec3(-half, -half, -length), Vec3(half, half, 0)}));
      return subtract(outside, ball(centre, half - tool.thickness_mm));
    }
    case ToolKind::trial_stem:
      return convex(tapered_stem(tool));
    default:
      return cut_solid(tool);
  }
}

Implicit tool_solid(const Tool& tool) {
  Implicit part = cutting_part(tool);
  if (tool.shank_length_mm <= 0.0) return part;
  switch (tool.kind) {
    case ToolKind::oscillating_saw:
    case ToolKind::reciprocating_saw: {
      // The plate behind the teeth is thinner by their set, so it runs free in the kerf.
      const double x = 0.5 * tool.width_mm, y = 0.5 * tool.thickness_mm;
      return unite(std::move(part), cuboid({Vec3(-x, -y, -tool.reach_mm()), Vec3(x, y, -tool.cutting_length_mm)}));
    }
    case ToolKind::outside_reamer: {
      // A plate closes the cup that carries the ring, and the shank stands on the plate.
      const double length = tool.cutting_length_mm;
      Implicit plate = cylinder(0.5 * tool.diameter_mm, -length - tool.thickness_mm, -length);
      return unite(unite(std::move(part), std::move(plate)), shank(tool));
    }
    default:
      return unite(std::move(part), shank(tool));
  }
}

}  // namespace osteon
