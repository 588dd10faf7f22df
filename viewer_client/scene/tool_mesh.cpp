#include "viewer_client/scene/tool_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "common/tools/tool_solid.hpp"
#include "common/tools/tool_surface.hpp"

namespace osteon {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kAround = 72;  // vertices round the axis

// A strip of the surface: points of (u in 0…1 along the profile, angle). `u` runs from the tip backwards.
using Patch = std::function<Vec3(double u, double angle_rad)>;

// Adds a strip with its own vertices, so that edges between strips stay sharp. Normals by central differences.
void add_strip(ToolMesh& mesh, const Patch& at, int steps, bool cutting) {
  const auto first = static_cast<std::uint32_t>(mesh.positions_mm.size());
  for (int i = 0; i <= steps; ++i) {
    // Where the strip shrinks to a point, its derivative round the axis vanishes. The normal is taken slightly beside
    // it.
    const double u = static_cast<double>(i) / steps;
    const double u_normal = std::clamp(u, 1e-3, 1.0 - 1e-3);
    for (int j = 0; j < kAround; ++j) {
      const double angle_rad = 2.0 * kPi * j / kAround;
      const double du = 5e-4, da = 1e-3;
      const Vec3 along = at(u_normal + du, angle_rad) - at(u_normal - du, angle_rad);
      const Vec3 round = at(u_normal, angle_rad + da) - at(u_normal, angle_rad - da);
      const Vec3 normal = along.cross(round).normalized();
      const Vec3 p = at(u, angle_rad);
      mesh.positions_mm.push_back({float(p.x()), float(p.y()), float(p.z())});
      mesh.normals.push_back({float(normal.x()), float(normal.y()), float(normal.z())});
      mesh.cutting.push_back(cutting ? 1 : 0);
    }
  }
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < kAround; ++j) {
      const std::uint32_t a = first + static_cast<std::uint32_t>(i * kAround + j);
      const std::uint32_t b = first + static_cast<std::uint32_t>(i * kAround + (j + 1) % kAround);
      const std::uint32_t c = a + kAround, d = b + kAround;
      mesh.triangles.push_back({a, d, b});
      mesh.triangles.push_back({a, c, d});
    }
  }
}

// Depth of a flute at an angle from the middle of a land: 0 on the land, 1 at the flute's bottom.
double flute_depth(double angle_rad, int flutes, double land_share) {
  const double turn = angle_rad * flutes / (2.0 * kPi);
  const double phase = turn - std::floor(turn);
  if (phase < land_share) return 0.0;
  const double s = std::sin(kPi * (phase - land_share) / (1.0 - land_share));
  return s * s;
}

Vec3 ring_point(double radius_mm, double angle_rad, double z_mm) {
  return {radius_mm * std::cos(angle_rad), radius_mm * std::sin(angle_rad), z_mm};
}

// A plain cone frustum of the profile, from (r0, z0) backwards to (r1, z1).
Patch frustum(double r0, double z0, double r1, double z1) {
  return [=](double u, double a) { return ring_point(r0 + u * (r1 - r0), a, z0 + u * (z1 - z0)); };
}

void add_drill(ToolMesh& mesh, const Tool& tool) {
  const double radius = 0.5 * tool.diameter_mm;
  const double tip = tool.point_angle_rad > 0.0 ? radius / std::tan(0.5 * tool.point_angle_rad) : 0.0;
  const double end = tool.cutting_length_mm;
  // Two helical flutes of 27 degrees, as on a twist drill. They fade out before the shank.
  const double helix = std::tan(27.0 * kPi / 180.0) / radius;
  const double fade = std::min(2.0 * tool.diameter_mm, 0.3 * end);
  const auto carved = [=](double full_radius, double a, double back_mm) {
    const double faded = std::clamp((end - back_mm) / fade, 0.0, 1.0);
    return full_radius * (1.0 - 0.38 * faded * flute_depth(a - helix * back_mm, 2, 0.42));
  };
  const int steps = std::clamp(static_cast<int>(end * 6.0), 24, 400);
  add_strip(
      mesh, [=](double u, double a) { return ring_point(carved(u * radius, a, u * tip), a, -u * tip); }, 8, true);
  add_strip(
      mesh,
      [=](double u, double a) {
        const double back = tip + u * (end - tip);
        return ring_point(carved(radius, a, back), a, -back);
      },
      steps, true);
}

void add_burr(ToolMesh& mesh, const Tool& tool, double neck_radius) {
  const double radius = 0.5 * tool.diameter_mm;
  // The ball from its tip to the point where the shank begins.
  const double last = kPi - std::asin(std::min(1.0, neck_radius / radius));
  const auto ball = [=](double u, double a) {
    const double polar = u * last;
    // Eight slanted flutes. They fade towards the tip, where they would meet, and towards the shank.
    const double fade = std::min({1.0, std::sin(polar) * 1.4, 6.0 * (1.0 - u)});
    const double r = radius * (1.0 - 0.10 * fade * flute_depth(a - 0.7 * polar, 8, 0.35));
    return ring_point(r * std::sin(polar), a, -radius + r * std::cos(polar));
  };
  add_strip(mesh, ball, 48, true);
}

// Approximate number of triangles of a tool without thin parts.
constexpr double kTriangles = 16000.0;
// A corner is sharp where a face's normal differs from the corner's normal by more than this (cosine).
constexpr double kSharp = 0.9;

// Any tool by its implicit solid. A corner on a sharp edge is drawn once for each face, with that face's normal.
ToolMesh surface_mesh(const Tool& tool) {
  const Implicit solid = tool_solid(tool), part = cutting_part(tool);
  const Vec3 size = solid.bounds.size_mm();
  const double area = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  const TriangleMesh surface = tool_surface(tool, std::sqrt(2.0 * area / kTriangles));
  ToolMesh mesh;
  mesh.positions_mm = surface.positions_mm;
  std::vector<Vec3> normals;
  for (std::uint32_t i = 0; i < surface.positions_mm.size(); ++i) {
    const Vec3 p = position(surface, i);
    normals.push_back(gradient(solid, p));
    mesh.cutting.push_back(tool.cuts() && part(p) <= solid(p) + 1e-9 ? 1 : 0);
  }
  const auto add_normal = [&mesh](const Vec3& n) {
    mesh.normals.push_back({float(n.x()), float(n.y()), float(n.z())});
  };
  for (const Vec3& n : normals) add_normal(n);
  for (const auto& triangle : surface.triangles) {
    const Vec3 a = position(surface, triangle[0]);
    const Vec3 across = (position(surface, triangle[1]) - a).cross(position(surface, triangle[2]) - a);
    if (across.norm() < 1e-12) continue;
    const Vec3 face = across.normalized();
    std::array<std::uint32_t, 3> corners = triangle;
    for (std::uint32_t& corner : corners) {
      if (normals[corner].dot(face) > kSharp) continue;
      mesh.positions_mm.push_back(mesh.positions_mm[corner]);
      mesh.cutting.push_back(mesh.cutting[corner]);
      add_normal(face);
      corner = static_cast<std::uint32_t>(mesh.positions_mm.size() - 1);
    }
    mesh.triangles.push_back(corners);
  }
  return mesh;
}

}  // namespace

ToolMesh tool_mesh(const Tool& tool) {
  if (tool.kind != ToolKind::drill && tool.kind != ToolKind::round_burr) return surface_mesh(tool);
  ToolMesh mesh;
  const double shank = 0.5 * tool.shank_diameter_mm;
  const double end = tool.cutting_length_mm, reach = tool.reach_mm();
  double shank_from = end;
  if (tool.kind == ToolKind::drill) {
    add_drill(mesh, tool);
    if (tool.diameter_mm != tool.shank_diameter_mm) {
      add_strip(mesh, frustum(0.5 * tool.diameter_mm, -end, shank, -end), 1, false);
    }
  } else {
    const double radius = 0.5 * tool.diameter_mm;
    const double neck = std::min(shank, 0.98 * radius);
    add_burr(mesh, tool, neck);
    // The shank begins inside the ball, where the sphere is as thin as the shank.
    shank_from = radius + std::sqrt(radius * radius - neck * neck);
  }
  if (reach > shank_from && shank > 0.0) {
    add_strip(mesh, frustum(shank, -shank_from, shank, -reach), 1, false);
    add_strip(mesh, frustum(shank, -reach, 0.0, -reach), 1, false);
  }
  return mesh;
}

}  // namespace osteon
