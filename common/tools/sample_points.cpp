// The points that touch bone: rings on drills and round burs, and points spread over the surface of every other tool.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "common/core/check.hpp"
#include "common/tools/spread_points.hpp"
#include "common/tools/tool.hpp"
#include "common/tools/tool_solid.hpp"
#include "common/tools/tool_surface.hpp"

namespace osteon {
namespace {

using std::numbers::pi;

// One ring of points at (r, z) whose normal into the tool is `inward` in the (radial, axial) plane.
void add_ring(std::vector<SamplePoint>& points, double r, double z, Corner inward, double area, double spacing,
              bool active) {
  const int count = std::max(3, static_cast<int>(std::ceil(2.0 * pi * r / spacing)));
  // Successive rings are rotated against each other, so that no straight seam stays unsampled.
  const double turn = 0.5 * static_cast<double>(points.size());
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * pi * (i + turn) / count;
    const double c = std::cos(angle), s = std::sin(angle);
    points.push_back({{r * c, r * s, z}, {inward.r * c, inward.r * s, inward.z}, area / count, active});
  }
}

void add_frustum(std::vector<SamplePoint>& points, Corner a, Corner b, double spacing, bool active) {
  const double er = b.r - a.r, ez = b.z - a.z, length = std::hypot(er, ez);
  const int rings = std::max(1, static_cast<int>(std::ceil(length / spacing)));
  // Corners run from the tip backwards (z falls), so the direction rotated by a right angle points to the axis.
  const Corner inward{ez / length, -er / length};
  for (int i = 0; i < rings; ++i) {
    const double t = (i + 0.5) / rings;
    const double r = a.r + t * er;
    add_ring(points, r, a.z + t * ez, inward, 2.0 * pi * r * length / rings, spacing, active);
  }
}

void add_sphere(std::vector<SamplePoint>& points, double radius, double shank_radius, double spacing) {
  const int rings = std::max(2, static_cast<int>(std::ceil(pi * radius / spacing)));
  for (int i = 0; i < rings; ++i) {
    const double polar = pi * (i + 0.5) / rings;  // from the tip
    const double r = radius * std::sin(polar), up = radius * std::cos(polar);
    if (up < 0.0 && r < shank_radius) continue;  // here the shank leaves the sphere
    const double area = 2.0 * pi * radius * radius * (std::cos(pi * i / rings) - std::cos(pi * (i + 1) / rings));
    add_ring(points, r, up - radius, {-std::sin(polar), -std::cos(polar)}, area, spacing, true);
  }
}

std::vector<SamplePoint> points_with_spacing(const Tool& tool, double spacing) {
  std::vector<SamplePoint> points;
  const double shank_radius = 0.5 * tool.shank_diameter_mm;
  // Walls only block, so they are sampled less densely than the cutting face.
  const double wall_spacing = std::max(2.0 * spacing, tool.shank_diameter_mm / 3.0);
  if (tool.kind == ToolKind::drill) {
    const double radius = 0.5 * tool.diameter_mm, height = point_height_mm(tool);
    add_frustum(points, {0, 0}, {radius, -height}, spacing, true);
    add_frustum(points, {radius, -height}, {radius, -tool.cutting_length_mm}, wall_spacing, false);
  } else {
    add_sphere(points, 0.5 * tool.diameter_mm, shank_radius, spacing);
  }
  add_frustum(points, {shank_radius, -tool.cutting_length_mm}, {shank_radius, -tool.reach_mm()}, wall_spacing, false);
  return points;
}

std::vector<SamplePoint> points_on_rings(const Tool& tool, int count) {
  const double radius = 0.5 * tool.diameter_mm;
  double spacing = std::sqrt(4.0 * pi * radius * radius / std::max(1, count));
  while (true) {
    std::vector<SamplePoint> points = points_with_spacing(tool, spacing);
    if (std::ranges::count_if(points, &SamplePoint::active) >= count) return points;
    spacing *= 0.95;
  }
}

// Tools that bore forwards cut only with their end, because their sides run in the hole that the end has made.
bool cuts_forwards_only(ToolKind kind) {
  return kind == ToolKind::end_drill || kind == ToolKind::pin || kind == ToolKind::screw;
}

// What decides which points of a tool cut.
struct Cutting {
  Tool tool;
  Implicit solid, part;
  explicit Cutting(const Tool& of) : tool(of), solid(tool_solid(of)), part(cutting_part(of)) {}
  // Whether a point of the surface cuts.
  [[nodiscard]] bool operator()(const Vec3& p, const Vec3& outward) const {
    // The back face of a tool never cuts.
    constexpr double kNear_mm = 0.01;
    if (!tool.cuts() || part(p) > solid(p) + 1e-9 || p.z() < -tool.cutting_length_mm + kNear_mm) return false;
    return !cuts_forwards_only(tool.kind) || (outward.z() > 0.1 && p.z() > -point_height_mm(tool) - kNear_mm);
  }
  // Cells of the surface well below the spacing of `count` points, but not finer than the tool needs.
  [[nodiscard]] double cell_mm(int count) const {
    const Vec3 size = part.bounds.size_mm();
    const double face_mm2 = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
    return std::max(0.5 * std::sqrt(face_mm2 / std::max(1, count)), 0.25);
  }
};

std::vector<SamplePoint> points_that_cut(const Cutting& cutting, const TriangleMesh& surface, int count) {
  std::vector<SamplePoint> points = spread_points(cutting.solid, surface, std::cref(cutting), {.count = count});
  OSTEON_CHECK(!points.empty());
  for (SamplePoint& point : points) point.active = true;
  return points;
}

bool has_rings(const Tool& tool) { return tool.kind == ToolKind::drill || tool.kind == ToolKind::round_burr; }

}  // namespace

std::vector<SamplePoint> sample_points(const Tool& tool, int count) {
  if (has_rings(tool)) return points_on_rings(tool, count);
  const Cutting cutting(tool);
  const TriangleMesh surface = tool_surface(tool, cutting.cell_mm(count));
  if (!tool.cuts()) {
    const auto all = [](const Vec3&, const Vec3&) { return true; };
    return spread_points(cutting.solid, surface, all, {.count = count});
  }
  std::vector<SamplePoint> points = points_that_cut(cutting, surface, count);
  double active_mm2 = 0.0;
  for (const SamplePoint& point : points) active_mm2 += point.area_mm2;
  // Walls only block, so they are sampled less densely than the cutting face.
  const double spacing = std::sqrt(active_mm2 / static_cast<double>(points.size()));
  const auto passive = [&](const Vec3& p, const Vec3& outward) { return !cutting(p, outward); };
  const auto walls = spread_points(cutting.solid, surface, passive,
                                   {.spacing_mm = std::max(2.0 * spacing, tool.shank_diameter_mm / 3.0)});
  points.insert(points.end(), walls.begin(), walls.end());
  return points;
}

std::vector<SamplePoint> active_points(const Tool& tool, int count) {
  OSTEON_CHECK(tool.cuts());
  if (!has_rings(tool)) {
    const Cutting cutting(tool);
    return points_that_cut(cutting, cutting_surface(tool, cutting.cell_mm(count)), count);
  }
  std::vector<SamplePoint> points = points_on_rings(tool, count);
  std::erase_if(points, [](const SamplePoint& point) { return !point.active; });
  return points;
}

}  // namespace osteon
