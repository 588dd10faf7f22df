#include "tests/support/scenes/known_cuts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/core/check.hpp"
#include "common/surface/mesh_block.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kLevel = 2;
// A vertex nearer than this to another face may be on the rounded edge between the two.
constexpr double kEdgePitches = 2.0;

double density(const Vec3&) { return 1.9; }

Cut pose_cut(const Tool& tool, const std::vector<Pose>& path) {
  Cut cut{.author = {1},
          .author_seq = 1,
          .lease_epoch = 1,
          .body = {},
          .tool = tool.hash(),
          .level = kLevel,
          .path = {},
          .spindle_rpm = 1000};
  for (const Pose& pose : path) cut.path.push_back(quantise(pose));
  return cut;
}

// Lengths of a tool are sent in whole quanta. The closed forms use the tool that everybody has.
double in_quanta(double mm) { return std::round(mm / kQuantum_mm) * kQuantum_mm; }

// A direction at most `angle` from +z.
Vec3 near_z(Random& random, double angle) {
  const double cosine = random.between(std::cos(angle), 1.0), turn = random.between(0.0, 2.0 * kPi);
  const double sine = std::sqrt(1.0 - cosine * cosine);
  return {sine * std::cos(turn), sine * std::sin(turn), cosine};
}

}  // namespace

KnownCut sphere_in_bone(const Tool& burr, double pitch_mm, Random& random) {
  const double radius = in_quanta(0.5 * burr.diameter_mm), h = 4.0 * pitch_mm;
  const Vec3 around = random.in_cube(0.5 * h);
  const double half = radius + 4.0 * h;
  const Box extent{around.array() - half, around.array() + half};
  const auto box_distance = [=](const Vec3& p) { return ((p - around).cwiseAbs().array() - half).maxCoeff(); };
  const Vec3 axis = random.direction();
  const Cut cut = pose_cut(burr, {pose_along(around + radius * axis, axis)});
  const Vec3 centre = dequantise(cut.path[0]).point({0.0, 0.0, -radius});
  return {make_bone(extent, h, box_distance, density), cut, 4.0 / 3.0 * kPi * radius * radius * radius,
          [=](const Vec3& p) -> std::optional<double> { return (p - centre).norm() - radius; }};
}

KnownCut hole_through_slab(const Tool& drill, double pitch_mm, Random& random) {
  constexpr double kThickness_mm = 5.0;
  const double radius = in_quanta(0.5 * drill.diameter_mm), h = 4.0 * pitch_mm;
  const Vec3 middle = random.in_cube(0.5 * h);
  const double half = 0.5 * kThickness_mm;
  // The slab's sides are beyond the reach of the hole.
  const double side = half * std::tan(kPi / 6.0) + 1.2 * radius + 5.0 * h;
  const Vec3 sides{side, side, half};
  const auto distance = [=](const Vec3& p) { return std::abs(p.z() - middle.z()) - half; };
  const Vec3 into = -near_z(random, kPi / 6.0);
  const double point_mm = radius / std::tan(0.5 * drill.point_angle_rad);
  const double way = half / std::abs(into.z()) + radius * std::tan(std::acos(-into.z())) + point_mm + 5.0 * pitch_mm;
  const Cut cut =
      pose_cut(drill, {pose_along(middle - (way + point_mm) * into, into), pose_along(middle + way * into, into)});
  const Pose end = dequantise(cut.path.back());
  const Vec3 axis = end.direction(Vec3::UnitZ()), through = end.position_mm;
  return {make_bone({middle - sides, middle + sides}, h, distance, density), cut,
          kPi * radius * radius * kThickness_mm / std::abs(axis.z()), [=](const Vec3& p) -> std::optional<double> {
            if (half - std::abs(p.z() - middle.z()) < kEdgePitches * pitch_mm) return std::nullopt;
            const Vec3 across = (p - through) - (p - through).dot(axis) * axis;
            return across.norm() - radius;
          }};
}

KnownCut kerf_through_shaft(const Tool& saw, double pitch_mm, Random& random) {
  const double h = 4.0 * pitch_mm, kerf = 2.0 * in_quanta(0.5 * (saw.thickness_mm + saw.set_mm));
  const double shaft = std::min(5.0, 0.42 * saw.width_mm);
  const Vec3 middle = random.in_cube(0.5 * h);
  const double half_length = shaft * std::tan(kPi / 7.2) + 2.0 * kerf + 5.0 * h;
  const Vec3 half{shaft, shaft, half_length};
  const auto distance = [=](const Vec3& p) { return std::hypot(p.x() - middle.x(), p.y() - middle.y()) - shaft; };
  // The blade's plane has its normal (the tool's y) near the shaft's axis. The direction of the blade in that plane is
  // random.
  const Vec3 normal = near_z(random, kPi / 7.2);
  const Vec3 any = random.direction();
  const Vec3 into = (any - any.dot(normal) * normal).normalized();
  Eigen::Matrix3d axes;
  axes.col(1) = normal;
  axes.col(2) = into;
  axes.col(0) = normal.cross(into);
  const Eigen::Quaterniond rotation(axes);
  const double way = shaft / normal.z() + 6.0 * pitch_mm;
  // The teeth enter beside the shaft and leave well behind it, because the corners of a swinging blade trail.
  const double trail =
      0.5 * saw.width_mm * std::tan(0.5 * saw.swing_rad) + saw.pivot_mm * (1.0 - std::cos(0.5 * saw.swing_rad));
  const Cut cut =
      pose_cut(saw, {{middle - (way + 1.0) * into, rotation}, {middle + (way + trail + 1.0) * into, rotation}});
  const Pose end = dequantise(cut.path.back());
  const Vec3 y = end.direction(Vec3::UnitY()), on = end.position_mm;
  return {make_bone({middle - half, middle + half}, h, distance, density), cut,
          kPi * shaft * shaft * kerf / std::abs(y.z()), [=](const Vec3& p) -> std::optional<double> {
            if (shaft - std::hypot(p.x() - middle.x(), p.y() - middle.y()) < kEdgePitches * pitch_mm)
              return std::nullopt;
            return std::abs((p - on).dot(y)) - 0.5 * kerf;
          }};
}

std::optional<Tool> nearest_tool(ToolKind kind, double diameter_mm) {
  std::optional<Tool> best;
  for (const Tool& tool : builtin_tools())
    if (tool.kind == kind &&
        (!best || std::abs(tool.diameter_mm - diameter_mm) < std::abs(best->diameter_mm - diameter_mm)))
      best = tool;
  return best;
}

std::optional<Tool> widest_saw() {
  std::optional<Tool> best;
  for (const Tool& tool : builtin_tools())
    if (tool.kind == ToolKind::oscillating_saw && (!best || tool.width_mm > best->width_mm)) best = tool;
  return best;
}

CutAccuracy accuracy_of(const KnownCut& known) {
  CutField field(known.bone, BodyId{});
  const CutReport report = field.apply(known.cut);
  CutAccuracy accuracy;
  accuracy.volume_error = field.removed_mm3() / known.removed_mm3 - 1.0;

  const double pitch = level_pitch_mm(known.bone.pitch_mm(), kLevel);
  std::set<BlockKey> blocks;
  for (const Coord& leaf : report.changed_leaves)
    blocks.insert({.body = {}, .level = kLevel, .index = shift_down(leaf, 4)});
  for (const BlockKey& key : blocks) {
    const CoordBox box = block_samples(key);
    std::vector<float> solid(kBlockApron * kBlockApron * kBlockApron), uncut(solid.size());
    field.gather_solid(kLevel, box, solid);
    field.gather_surface(kLevel, box, uncut);
    const auto mesh = decode_block(key, encode_block(solid, uncut, 0, pitch), pitch);
    OSTEON_CHECK(mesh.has_value());
    for (std::size_t i = 0; i < mesh->positions_mm.size(); ++i) {
      if (mesh->cut_face[i] == 0) continue;
      const auto& p = mesh->positions_mm[i];
      if (const auto deviation = known.deviation_mm({p[0], p[1], p[2]}))
        accuracy.deviation_pitches.push_back(std::abs(*deviation) / pitch);
    }
  }
  return accuracy;
}

}  // namespace osteon::test
