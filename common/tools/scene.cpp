#include "common/tools/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/geometry/pose_across.hpp"

namespace osteon {
namespace {

using std::numbers::pi;

std::string shown(const Vec3& v) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "(%.1f, %.1f, %.1f)", v.x(), v.y(), v.z());
  return text.data();
}

// Evenly spread directions on a sphere, by the golden angle.
Vec3 direction(int i, int count) {
  const double z = 1.0 - (2.0 * i + 1.0) / count, r = std::sqrt(1.0 - z * z), angle = pi * (3.0 - std::sqrt(5.0)) * i;
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Vec3 gradient(const BoneQuery& bone, const Vec3& p, double step_mm) {
  Vec3 result;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = step_mm * Vec3::Unit(axis);
    result[axis] = (bone(p + step) - bone(p - step)) / (2.0 * step_mm);
  }
  return result;
}

// The surface crossing between a point outside and one inside.
Vec3 crossing(const BoneQuery& bone, Vec3 outside, Vec3 inside) {
  for (int i = 0; i < 40; ++i) {
    const Vec3 middle = 0.5 * (outside + inside);
    (bone(middle) < 0.0 ? inside : outside) = middle;
  }
  return 0.5 * (outside + inside);
}

bool is_guide(ToolKind kind) {
  return kind == ToolKind::drill_sleeve || kind == ToolKind::distal_block || kind == ToolKind::four_in_one_block;
}

// Motion in the item's own frame: along z, across it, and between the axes.
struct Motion {
  double along_mm, across_mm, tilt_rad, turn_rad;
};
Motion motion(const Pose& from, const Pose& to) {
  const Pose by = from.inverse() * to;
  const Vec3 axis = by.direction(Vec3::UnitZ()), x = by.direction(Vec3::UnitX());
  return {by.position_mm.z(), by.position_mm.head<2>().norm(), std::atan2(axis.head<2>().norm(), axis.z()),
          std::atan2(x.y(), x.x())};
}

// The part of an implant's surface that faces the direction of insertion: its end and outside, not its hollow.
std::vector<SamplePoint> facing_points(const Tool& implant, int count) {
  std::vector<SamplePoint> points = sample_points(implant, count);
  std::erase_if(points, [](const SamplePoint& point) {
    const Vec3 outward = -point.inward;
    const double radial = outward.head<2>().dot(point.position_mm.head<2>());
    return outward.z() < -0.05 || radial < 0.0;
  });
  return points;
}

Fit fit_of_points(const std::vector<SamplePoint>& points, const Pose& pose, const BoneQuery& bone,
                  const FitParams& params) {
  Fit fit;
  double area = 0.0, contact = 0.0;
  for (const SamplePoint& point : points) {
    const double gap = bone(pose.point(point.position_mm));
    area += point.area_mm2;
    if (std::abs(gap) <= params.tolerance_mm) contact += point.area_mm2;
    fit.largest_gap_mm = std::max(fit.largest_gap_mm, gap);
    fit.largest_overlap_mm = std::max(fit.largest_overlap_mm, -gap);
  }
  if (area > 0.0) fit.contact_fraction = contact / area;
  return fit;
}

Pose advanced(const Pose& pose, double along_mm, double turn_rad = 0.0) {
  return pose * Pose{{0, 0, along_mm}, Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vec3::UnitZ()))};
}

// Whether the underside of a screw's head, outside the hole of its thread, is in bone.
bool head_meets_bone(const Tool& screw, const Pose& pose, const BoneQuery& bone) {
  const double inner = 0.5 * screw.diameter_mm, outer = 0.5 * screw.shank_diameter_mm;
  constexpr int kRings = 3, kAround = 24;
  for (int ring = 1; ring <= kRings; ++ring) {
    const double r = inner + (outer - inner) * ring / kRings;
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2.0 * pi * i / kAround;
      if (bone(pose.point({r * std::cos(angle), r * std::sin(angle), -screw.cutting_length_mm})) < 0.0) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<SurfacePlace> nearest_surface(const BoneQuery& bone, const Vec3& near_mm, double reach_mm) {
  constexpr int kDirections = 400;
  constexpr double kStep_mm = 0.25, kNormal_mm = 0.5;
  const bool inside = bone(near_mm) < 0.0;
  std::optional<Vec3> found;
  for (double r = kStep_mm; r <= reach_mm && !found; r += kStep_mm) {
    double deepest = 0.0;
    for (int i = 0; i < kDirections; ++i) {
      const Vec3 p = near_mm + r * direction(i, kDirections);
      const double value = bone(p);
      if ((value < 0.0) == inside || (found && std::abs(value) <= deepest)) continue;
      deepest = std::abs(value);
      found = inside ? crossing(bone, p, near_mm) : crossing(bone, near_mm, p);
    }
  }
  if (!found) return std::nullopt;

  // The foot of the perpendicular: first along the normal to the surface, then by the remaining step along the surface.
  Vec3 at = *found;
  Vec3 outward = Vec3::UnitZ();
  for (int i = 0; i < 20; ++i) {
    const Vec3 slope = gradient(bone, at, kNormal_mm);
    if (!(slope.norm() > 1e-6)) break;
    outward = slope.normalized();
    const Vec3 away = near_mm - at, along = away - away.dot(outward) * outward;
    if (along.norm() < 1e-3) break;
    Vec3 next = at + 0.7 * along;
    const double reach = 2.0 + along.norm();
    if (bone(next + reach * outward) < 0.0 || bone(next - reach * outward) >= 0.0) break;
    next = crossing(bone, next + reach * outward, next - reach * outward);
    if ((near_mm - next).norm() >= (near_mm - at).norm()) break;
    at = next;
  }
  const Vec3 slope = gradient(bone, at, kNormal_mm);
  if (slope.norm() > 1e-6) outward = slope.normalized();
  return SurfacePlace{at, outward};
}

Result<Pose> place_on_bone(const BoneQuery& bone, const Vec3& near_mm, const std::optional<Vec3>& axis,
                           const Vec3& across) {
  const auto place = nearest_surface(bone, near_mm);
  if (!place)
    return failure(ErrorCode::invalid_input,
                   "no bone lies within 20 mm of " + shown(near_mm) + "; choose a point nearer to it");
  const Vec3 z = axis && axis->norm() > 1e-9 ? Vec3(axis->normalized()) : Vec3(-place->outward);
  const bool has_side = (across - across.dot(z) * z).norm() > 1e-6;
  return pose_across(place->point_mm, z, has_side ? across : z.unitOrthogonal());
}

int pins_in(const Tool& guide, const Pose& pose_bone_guide, std::span<const Standing> scene) {
  const GuideShape shape = guide_shape(guide);
  int count = 0;
  for (std::size_t i = 0; i < shape.pin_holes.size(); ++i) {
    const std::size_t opening = shape.bores.size() + i;
    count += std::ranges::any_of(scene, [&](const Standing& pin) {
      if (pin.tool.kind != ToolKind::pin) return false;
      // Only the part that goes through counts, because a head holds the guide down from outside.
      Tool body = pin.tool;
      body.shank_diameter_mm = std::min(body.shank_diameter_mm, body.diameter_mm);
      if (!fits(shape, opening, body)) return false;
      const auto held = constrain(shape, opening, pose_bone_guide, body, pin.item.pose_bone_item);
      return held && held->correction_mm < 1e-6 && held->depth_mm > shape.pin_holes[i].length_mm;
    });
  }
  return count;
}

Result<SceneItem> set_by_rules(std::span<const Standing> scene, const Standing* before, const Standing& wanted,
                               const BoneQuery& bone) {
  constexpr double kAcross_mm = 0.01, kTilt_rad = 1e-3, kThread_mm = 0.02;
  SceneItem item = wanted.item;
  const Tool& tool = wanted.tool;
  const std::string name = "\"" + tool.name + "\"";
  if (before && before->item.tool != item.tool)
    return failure(ErrorCode::invalid_input, "an item cannot become another tool; take it out and set " + name);
  if (tool.cuts() && tool.kind != ToolKind::pin && tool.kind != ToolKind::screw && tool.kind != ToolKind::mesh)
    return failure(ErrorCode::invalid_input,
                   name + " is a hand-held tool; only guides, pins, screws and implants stand on the bone");
  const Motion moved = before ? motion(before->item.pose_bone_item, item.pose_bone_item) : Motion{};
  const bool moves =
      before && (std::abs(moved.along_mm) > kAcross_mm || moved.across_mm > kAcross_mm || moved.tilt_rad > kTilt_rad ||
                 (std::abs(moved.turn_rad) > kTilt_rad && tool.kind != ToolKind::pin && tool.kind != ToolKind::screw));
  if (is_guide(tool.kind)) {
    if (moves && pins_in(tool, before->item.pose_bone_item, scene) >= kPinsThatFix)
      return failure(ErrorCode::invalid_input, name + " is fixed by pins and cannot be moved; draw a pin first");
    item.seated = pins_in(tool, item.pose_bone_item, scene) >= kPinsThatFix;
    return item;
  }
  if (tool.kind == ToolKind::pin || tool.kind == ToolKind::screw) {
    if (moves && (moved.across_mm > kAcross_mm || moved.tilt_rad > kTilt_rad))
      return failure(ErrorCode::invalid_input,
                     name + " is in its hole and moves along its axis only; take it out to set it elsewhere");
    if (tool.kind == ToolKind::pin) return item;
    if (before && std::abs(moved.along_mm - tool.thread_pitch_mm * (item.turns - before->item.turns)) > kThread_mm)
      return failure(ErrorCode::invalid_input, name + " follows its thread: its way must be its pitch times its turns");
    if (bone) item.seated = head_meets_bone(tool, advanced(item.pose_bone_item, kThread_mm), bone);
    return item;
  }
  if ((tool.kind == ToolKind::trial_cup || tool.kind == ToolKind::trial_stem) && bone) {
    const FitParams params;
    const Fit fit = fit_of(tool, item.pose_bone_item, bone, params);
    item.seated = fit.contact_fraction >= params.least_contact && fit.largest_overlap_mm <= params.tolerance_mm;
  }
  return item;
}

Driven turn_screw(const Tool& screw, const Pose& pose_bone_screw, double turns, const BoneQuery& bone) {
  const double pitch = screw.thread_pitch_mm;
  const auto at = [&](double t) { return advanced(pose_bone_screw, pitch * t, 2.0 * pi * t); };
  if (turns <= 0.0) return {at(turns), turns, turns == 0.0 && head_meets_bone(screw, pose_bone_screw, bone)};
  // Steps of 0.05 mm, so that no bone is skipped. Then the exact position at which the head meets it.
  const double step = 0.05 / std::max(0.05, pitch);
  double free = 0.0;
  if (head_meets_bone(screw, pose_bone_screw, bone)) return {pose_bone_screw, 0.0, true};
  while (free < turns) {
    const double next = std::min(turns, free + step);
    if (head_meets_bone(screw, at(next), bone)) {
      double low = free, high = next;
      for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        (head_meets_bone(screw, at(middle), bone) ? high : low) = middle;
      }
      return {at(low), low, true};
    }
    free = next;
  }
  return {at(turns), turns, false};
}

Fit fit_of(const Tool& implant, const Pose& pose_bone_implant, const BoneQuery& bone, const FitParams& params) {
  return fit_of_points(facing_points(implant, params.points), pose_bone_implant, bone, params);
}

Result<Seating> drive_home(const Tool& implant, const Pose& pose_bone_implant, double most_mm, const BoneQuery& bone,
                           const FitParams& params) {
  const std::vector<SamplePoint> points = facing_points(implant, params.points);
  const auto blocked = [&](double along_mm) {
    const Pose pose = advanced(pose_bone_implant, along_mm);
    return std::ranges::any_of(points, [&](const SamplePoint& point) {
      return bone(pose.point(point.position_mm)) < -params.most_overlap_mm;
    });
  };
  if (blocked(0.0))
    return failure(ErrorCode::invalid_input, "\"" + implant.name + "\" meets bone where it starts; draw it back");
  constexpr double kStep_mm = 0.1;
  Seating seating;
  while (seating.advance_mm < most_mm && !seating.stopped) {
    const double next = std::min(most_mm, seating.advance_mm + kStep_mm);
    if (!blocked(next)) {
      seating.advance_mm = next;
      continue;
    }
    double low = seating.advance_mm, high = next;
    for (int i = 0; i < 20; ++i) {
      const double middle = 0.5 * (low + high);
      (blocked(middle) ? high : low) = middle;
    }
    seating.advance_mm = low;
    seating.stopped = true;
  }
  seating.pose_bone_item = advanced(pose_bone_implant, seating.advance_mm);
  seating.fit = fit_of_points(points, seating.pose_bone_item, bone, params);
  seating.seated = seating.stopped && seating.fit.contact_fraction >= params.least_contact;
  return seating;
}

}  // namespace osteon
