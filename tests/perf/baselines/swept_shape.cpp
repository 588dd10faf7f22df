#include "tests/perf/baselines/swept_shape.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/field/cut.hpp"
#include "common/field/kernel.hpp"
#include "common/tools/tool_box.hpp"

namespace osteon::baselines {
namespace {

std::array<float, 3> floats(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

}  // namespace

SweptShape swept_shape(const Cut& cut, double pitch_mm) {
  const auto tools = builtin_tool_box();
  const CutBody& body = tools->find(cut.tool)->body;
  OSTEON_CHECK(cut.path.size() == 2 && (body.kind == CutKind::ball || body.kind == CutKind::turned) && body.dome == 0);
  const double pitch = level_pitch_mm(pitch_mm, cut.level);
  const Pose from = dequantise(cut.path.front()), to = dequantise(cut.path.back());
  const Vec3 motion = to.position_mm - from.position_mm;
  const Vec3 axis = from.rotation * Vec3::UnitZ(), u = from.rotation * Vec3::UnitX(), v = from.rotation * Vec3::UnitY();
  const double along = motion.dot(axis);

  SweptShape shape;
  shape.ball = body.kind == CutKind::ball;
  shape.pitch_mm = static_cast<float>(pitch);
  shape.band_mm = osteon::band_mm(pitch);
  shape.motion = floats(motion);
  shape.axis = floats(axis);
  shape.u = floats(u);
  shape.v = floats(v);
  Box box;
  if (shape.ball) {
    const double radius = body.radius * kQuantum_mm, square = motion.squaredNorm();
    const Vec3 centre = from.position_mm - radius * axis;
    shape.start = floats(centre);
    shape.radius = static_cast<float>(radius);
    shape.inverse_square = square > 0.0 ? static_cast<float>(1.0 / square) : 0.0f;
    box.include(centre);
    box.include(centre + motion);
    box = box.grown(radius);
  } else {
    OSTEON_CHECK((motion - along * axis).norm() < 1e-3);
    shape.start = floats(from.position_mm);
    // A turned body that moves along its axis is a turned body with a longer outline.
    const auto s_of = [&](const ProfileCorner& corner) {
      const bool lowest = corner.z == body.lowest[2];
      return corner.z * kQuantum_mm + (lowest ? std::min(0.0, along) : std::max(0.0, along));
    };
    double low = 1e9, high = -1e9, radius = 0.0;
    for (std::size_t i = 0; i < body.profile.size(); ++i) {
      const ProfileCorner &a = body.profile[i], &b = body.profile[(i + 1) % body.profile.size()];
      low = std::min(low, s_of(a));
      high = std::max(high, s_of(a));
      radius = std::max(radius, a.r * kQuantum_mm);
      if (a.r == 0 && b.r == 0) continue;
      const double r = a.r * kQuantum_mm, dr = b.r * kQuantum_mm - r, s = s_of(a), ds = s_of(b) - s;
      const double length = std::hypot(dr, ds);
      OSTEON_CHECK(shape.edge_count < SweptShape::kMostEdges);
      shape.edges[static_cast<std::size_t>(shape.edge_count++)] = {
          static_cast<float>(r), static_cast<float>(s), static_cast<float>(dr / length),
          static_cast<float>(ds / length), static_cast<float>(length)};
    }
    shape.radius = static_cast<float>(radius);
    for (const double s : {low, high})
      for (const double x : {-radius, radius})
        for (const double y : {-radius, radius}) box.include(from.position_mm + s * axis + x * u + y * v);
  }
  box = box.grown(static_cast<double>(shape.band_mm));
  shape.low = floats(box.min_mm);
  shape.high = floats(box.max_mm);
  return shape;
}

}  // namespace osteon::baselines
