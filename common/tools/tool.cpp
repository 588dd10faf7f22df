#include "common/tools/tool.hpp"

#include <algorithm>
#include <cmath>

#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

std::int32_t quanta(double mm) { return static_cast<std::int32_t>(std::lround(mm / kQuantum_mm)); }

double tip_height_mm(const Tool& tool) { return 0.5 * tool.diameter_mm / std::tan(0.5 * tool.point_angle_rad); }

// A point of a solid of revolution's outline: distance from the axis and position along it.
struct Outline {
  double r, z;
};

double segment_distance(Outline p, Outline a, Outline b) {
  const double er = b.r - a.r, ez = b.z - a.z;
  const double t = std::clamp(((p.r - a.r) * er + (p.z - a.z) * ez) / (er * er + ez * ez), 0.0, 1.0);
  return std::hypot(p.r - a.r - t * er, p.z - a.z - t * ez);
}

double drill_distance(const Tool& tool, Outline p) {
  const double radius = 0.5 * tool.diameter_mm, height = tip_height_mm(tool), length = tool.cutting_length_mm;
  const double slant = std::hypot(radius, height);
  const double inside = std::max({(p.r * height + p.z * radius) / slant, p.r - radius, -p.z - length});
  if (inside <= 0.0) return inside;
  const Outline tip{0, 0}, shoulder{radius, -height}, heel{radius, -length}, back{0, -length};
  return std::min(
      {segment_distance(p, tip, shoulder), segment_distance(p, shoulder, heel), segment_distance(p, heel, back)});
}

double cylinder_distance(double radius, double top, double bottom, Outline p) {
  const double dr = p.r - radius;
  const double dz = std::max(p.z - top, bottom - p.z);
  if (dr <= 0.0 || dz <= 0.0) return std::max(dr, dz);
  return std::hypot(dr, dz);
}

// Rounds a unit normal, and moves the face so that it passes through the same middle. Far from the tip, one step of the
// normal has more effect than one step of the offset.
HullPlane rounded(const HalfSpace& face, const std::vector<Vec3>& polygon) {
  HullPlane plane;
  Vec3 normal;
  for (int k = 0; k < 3; ++k) {
    plane.normal[static_cast<std::size_t>(k)] = static_cast<std::int16_t>(std::lround(face.normal[k] / kDirectionStep));
    normal[k] = plane.normal[static_cast<std::size_t>(k)];
  }
  normal.normalize();
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : polygon) middle += p / static_cast<double>(polygon.size());
  plane.offset = quanta(normal.dot(middle));
  return plane;
}

void make_hull(CutBody& body, const std::vector<HalfSpace>& faces) {
  const auto polygons = face_polygons(faces);
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (!polygons[i].empty()) body.planes.push_back(rounded(faces[i], polygons[i]));
  // The box of the solid that the rounded planes enclose.
  std::vector<HalfSpace> planes;
  for (const HullPlane& plane : body.planes) {
    const Vec3 normal = Vec3(plane.normal[0], plane.normal[1], plane.normal[2]).normalized();
    planes.push_back({normal, plane.offset * kQuantum_mm});
  }
  const Box box = box_of(face_polygons(planes));
  constexpr double kRounding = 1e-6;  // rounding of the corners' own arithmetic
  for (int k = 0; k < 3; ++k) {
    body.lowest[static_cast<std::size_t>(k)] =
        static_cast<std::int32_t>(std::floor(box.min_mm[k] / kQuantum_mm + kRounding));
    body.highest[static_cast<std::size_t>(k)] =
        static_cast<std::int32_t>(std::ceil(box.max_mm[k] / kQuantum_mm - kRounding));
  }
}

void make_turned(CutBody& body, const CutOutline& outline) {
  body.dome = quanta(outline.dome_mm);
  std::int32_t widest = 0, top = outline.profile.empty() ? 0 : quanta(outline.profile.front().z), bottom = top;
  for (const Corner& corner : outline.profile) {
    const ProfileCorner rounded_corner{quanta(corner.r), quanta(corner.z)};
    if (!body.profile.empty() && body.profile.back() == rounded_corner) continue;
    body.profile.push_back(rounded_corner);
    widest = std::max(widest, rounded_corner.r);
    top = std::max(top, rounded_corner.z);
    bottom = std::min(bottom, rounded_corner.z);
  }
  body.lowest = {-widest, -widest, bottom};
  body.highest = {widest, widest, top};
}

}  // namespace

bool Tool::cuts() const {
  return kind < ToolKind::drill_sleeve || kind == ToolKind::pin || kind == ToolKind::screw || kind == ToolKind::mesh;
}

CutBody Tool::cut_body() const {
  CutBody body;
  if (!cuts()) return body;
  const CutOutline outline = cut_outline(*this);
  body.kind = outline.kind;
  switch (outline.kind) {
    case CutKind::none:
      break;
    case CutKind::ball:
      body.radius = quanta(outline.radius_mm);
      body.lowest = {-body.radius, -body.radius, -2 * body.radius};
      body.highest = {body.radius, body.radius, 0};
      break;
    case CutKind::turned:
      make_turned(body, outline);
      break;
    case CutKind::hull:
      make_hull(body, outline.planes);
      break;
    case CutKind::sampled: {
      body.sampled = mesh;
      const CoordBox& box = mesh->box;
      body.lowest = {box.min.x * mesh->pitch, box.min.y * mesh->pitch, box.min.z * mesh->pitch};
      body.highest = {box.max.x * mesh->pitch, box.max.y * mesh->pitch, box.max.z * mesh->pitch};
      break;
    }
  }
  return body;
}

Digest Tool::hash() const {
  Hasher hasher;
  hasher.text(name);
  hasher.text(title);
  hasher.integer(static_cast<std::uint64_t>(kind));
  for (const double value : {diameter_mm, cutting_length_mm, point_angle_rad, shank_diameter_mm, shank_length_mm,
                             width_mm, thickness_mm, set_mm, swing_rad, stroke_mm, pivot_mm, taper_rad, corner_mm,
                             bore_mm, thread_pitch_mm, core_diameter_mm, spindle_rpm, feed_mm_per_rev})
    hasher.number(value);
  hasher.integer(static_cast<std::uint64_t>(teeth));
  hasher.integer(static_cast<std::uint64_t>(cut_level));
  hasher.integer(mesh ? mesh->values.size() : 0);
  if (mesh) {
    for (const std::int32_t value : {mesh->box.min.x, mesh->box.min.y, mesh->box.min.z, mesh->box.max.x,
                                     mesh->box.max.y, mesh->box.max.z, mesh->pitch})
      hasher.integer(static_cast<std::uint32_t>(value));
    for (const std::int16_t value : mesh->values) hasher.integer(static_cast<std::uint16_t>(value));
  }
  // Hashed only if given. So older definitions, without a law, keep their hash and their rooms stay valid.
  if (!law.empty()) hasher.text(law);
  return hasher.finish();
}

Box local_bounds(const Tool& tool) { return tool_solid(tool).bounds; }

Box world_bounds(const Tool& tool, const Pose& pose_bone_tool) {
  const Box local = local_bounds(tool);
  const Eigen::Matrix3d turn = pose_bone_tool.rotation.toRotationMatrix().cwiseAbs();
  const Vec3 centre = pose_bone_tool.point(local.centre_mm()), half = 0.5 * (turn * local.size_mm());
  return {centre - half, centre + half};
}

Vec3 normal(const Tool& tool, const Vec3& point_tool_mm) { return gradient(tool_solid(tool), point_tool_mm); }

double signed_distance_mm(const Tool& tool, const Vec3& point_tool_mm) {
  // The two most used tools are evaluated often, so they need no solid.
  if (tool.kind != ToolKind::drill && tool.kind != ToolKind::round_burr) return tool_solid(tool)(point_tool_mm);
  const Outline p{std::hypot(point_tool_mm.x(), point_tool_mm.y()), point_tool_mm.z()};
  const double shank = cylinder_distance(0.5 * tool.shank_diameter_mm, shank_start_mm(tool), -tool.reach_mm(), p);
  const double cutting = tool.kind == ToolKind::drill
                             ? drill_distance(tool, p)
                             : std::hypot(p.r, p.z + 0.5 * tool.diameter_mm) - 0.5 * tool.diameter_mm;
  return std::min(cutting, shank);
}

}  // namespace osteon
