#include "haptic_client/control/proxy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/segment.hpp"

namespace osteon::haptic {
namespace {

// Free travel in one tick: 500 mm/s. A device that moves faster is followed a little later.
constexpr double kMostTravel_mm = 0.5;
constexpr int kMostSubSteps = 24;
constexpr double kNothing_mm = 1e-6;
// Points whose face looks less than this into the direction of cutting neither cut nor resist.
constexpr double kLeastFacing = 0.2;

Vec3 sphere_centre(const Pose& pose, double radius_mm) noexcept { return pose.point({0, 0, -radius_mm}); }

}  // namespace

void Proxy::place(const Pose& pose_bone_tool) noexcept {
  pose_ = pose_bone_tool;
  sweep_count_ = 0;
  sweeping_ = false;
  cut_before_ = false;
}

bool Proxy::begin_sweep(const ToolModel& model) noexcept {
  if (sweep_count_ >= kMostSweeps) return false;
  sweeping_ = true;
  const Tool& tool = model.tool;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_++)];
  sweep.outline = model.axial ? &model.outline : nullptr;
  sweep.radius_mm = 0.5 * tool.diameter_mm;
  sweep.own_cut = 0;
  sweep.open = true;
  sweep.deepest = pose_;
  sweep.pose_deepest_bone = pose_.inverse();
  sweep.from_mm = sweep.to_mm = sphere_centre(pose_, sweep.radius_mm);
  return true;
}

void Proxy::closed(const ToolModel& model, std::uint64_t own_cut) noexcept {
  if (!sweeping_) return;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_ - 1)];
  sweep.own_cut = own_cut;
  constexpr double kSameAxis_rad = 1e-6, kSameAxis_mm = 0.02;
  const Vec3 away_mm = pose_.position_mm - sweep.deepest.position_mm;
  const Vec3 axis = pose_.direction(Vec3::UnitZ());
  if (sweep.outline && pose_.rotation.angularDistance(sweep.deepest.rotation) < kSameAxis_rad &&
      (away_mm - away_mm.dot(axis) * axis).norm() < kSameAxis_mm)
    return;
  sweep.open = false;
  sweeping_ = begin_sweep(model);
}

void Proxy::end_sweep() noexcept {
  if (!sweeping_) return;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_ - 1)];
  sweep.open = false;
  if (sweep.own_cut == 0) --sweep_count_;
  sweeping_ = false;
}

void Proxy::update_sweep() noexcept {
  if (!sweeping_) return;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_ - 1)];
  sweep.to_mm = sphere_centre(pose_, sweep.radius_mm);
  if ((pose_.position_mm - sweep.deepest.position_mm).dot(pose_.direction(Vec3::UnitZ())) <= 0.0) return;
  sweep.deepest = pose_;
  sweep.pose_deepest_bone = pose_.inverse();
}

void Proxy::forget_contained(const Patch& patch) noexcept {
  int kept = 0;
  for (int i = 0; i < sweep_count_; ++i) {
    const Sweep& sweep = sweeps_[static_cast<std::size_t>(i)];
    if (sweep.open || sweep.own_cut > patch.own_cuts) sweeps_[static_cast<std::size_t>(kept++)] = sweep;
  }
  sweep_count_ = kept;
}

double Proxy::distance_mm(const Sweep& sweep, const Vec3& point_mm) noexcept {
  if (!sweep.outline) return segment_distance_mm(point_mm, sweep.from_mm, sweep.to_mm) - sweep.radius_mm;
  return sweep.outline->distance_mm(sweep.pose_deepest_bone.point(point_mm));
}

bool Proxy::solid(const Patch& patch, const Vec3& point_mm, double& solid_mm) const noexcept {
  if (!patch.solid(point_mm, solid_mm)) return false;
  if (solid_mm > 0.3) return true;
  for (int i = 0; i < sweep_count_; ++i)
    solid_mm = std::max(solid_mm, -distance_mm(sweeps_[static_cast<std::size_t>(i)], point_mm));
  return true;
}

Vec3 Proxy::normal(const Patch& patch, const Vec3& point_mm) const noexcept {
  const double d = patch.fine.pitch_mm() > 0.0 ? patch.fine.pitch_mm() : 0.1;
  Vec3 gradient = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 offset = d * Vec3::Unit(axis);
    double above = 0.0, below = 0.0;
    if (solid(patch, point_mm + offset, above) && solid(patch, point_mm - offset, below)) gradient[axis] = above - below;
  }
  const double length = gradient.norm();
  return length > 1e-9 ? Vec3(gradient / length) : Vec3(Vec3::Zero());
}

Proxy::Engagement Proxy::engagement(const ToolModel& model, const Patch& patch, const Vec3& direction) const noexcept {
  Engagement result;
  result.nearest_mm = std::numeric_limits<double>::max();
  const Vec3 direction_tool = pose_.rotation.conjugate() * direction;
  const double ahead_mm = 0.25 * model.fine_pitch_mm;
  for (const ContactPoint& point : model.active) {
    const double facing = point.outward.dot(direction_tool);
    if (facing < kLeastFacing) continue;
    // From the inset point along the direction until a quarter pitch ahead of the face: never beyond the wall of the
    // tool's own hole.
    const double reach_mm = std::min((model.inset + ahead_mm) / facing, 2.0 * model.fine_pitch_mm);
    const Vec3 probe_mm = pose_.point(point.inset_mm) + reach_mm * direction;
    const double area_mm2 = point.area_mm2 * facing;
    double solid_mm = 0.0;
    if (!solid(patch, probe_mm, solid_mm)) {
      result.covered = false;
      return result;
    }
    result.area_mm2 += area_mm2;
    result.nearest_mm = std::min(result.nearest_mm, solid_mm);
    if (solid_mm >= 0.0) continue;
    const double density = patch.density_at(probe_mm);
    result.engaged_mm2 += area_mm2;
    result.density += area_mm2 * density;
    if (!model.axial)
      result.milling += milling_resistance(model.milling, area_mm2, point.axis_distance_mm, density);
  }
  if (result.engaged_mm2 > 0.0) result.density /= result.engaged_mm2;
  return result;
}

Vec3 Proxy::slide(const ToolModel& model, const Patch& patch, Vec3 step_mm, bool active_too, const Vec3* across,
                  bool& blocked, bool& covered) const noexcept {
  for (int attempt = 0; attempt < 4; ++attempt) {
    double worst_mm = 0.0;
    Vec3 worst_point = Vec3::Zero();
    const auto test = [&](const ContactPoint& point) {
      const Vec3 at_mm = pose_.point(point.inset_mm);
      double after_mm = 0.0, before_mm = 0.0;
      if (!solid(patch, at_mm + step_mm, after_mm)) {
        covered = false;
        return;
      }
      if (after_mm >= 0.0 || !solid(patch, at_mm, before_mm)) return;
      // Only what makes it worse counts: a tool that was left inside bone can always be drawn out.
      const double deeper_mm = std::min(-after_mm, before_mm - after_mm);
      if (deeper_mm > worst_mm) {
        worst_mm = deeper_mm;
        worst_point = at_mm + step_mm;
      }
    };
    for (const ContactPoint& point : model.passive) test(point);
    if (active_too)
      for (const ContactPoint& point : model.active) test(point);
    if (worst_mm <= 1e-9) return step_mm;

    blocked = true;
    Vec3 out = normal(patch, worst_point);
    if (across) out -= out.dot(*across) * *across;
    const double length = out.norm();
    if (length < 0.1) return Vec3::Zero();
    step_mm += out * (worst_mm / (length * length));
  }
  return Vec3::Zero();
}

void Proxy::travel(const ToolModel& model, const Patch& patch, Vec3 left_mm, const Vec3* across,
                   ProxyStep& report) noexcept {
  // Small steps, so that no thin wall is jumped over.
  constexpr int kSteps = 6;
  const double longest_mm = 0.5 * model.fine_pitch_mm;
  for (int i = 0; i < kSteps && left_mm.norm() > kNothing_mm; ++i) {
    const Vec3 piece_mm = left_mm * std::min(1.0, longest_mm / left_mm.norm());
    const Vec3 by_mm = slide(model, patch, piece_mm, true, across, report.contact, report.covered);
    if (!report.covered) return;
    pose_.position_mm += by_mm;
    report.moved_mm += by_mm;
    left_mm -= piece_mm;
  }
}

void Proxy::advance(const ToolModel& model, const Patch& patch, const Vec3& direction, double distance_mm,
                    double spindle_rpm, double stiffness_n_per_mm, bool may_cut, double dt_s, ProxyStep& report) noexcept {
  const double least_mm = 0.25 * model.fine_pitch_mm;
  double extension_mm = distance_mm;
  double free_mm = std::min(distance_mm, kMostTravel_mm);
  double left_s = dt_s;
  double cut_mm = 0.0;
  for (int i = 0; i < kMostSubSteps && extension_mm > 0.0 && left_s > 0.0; ++i) {
    const Engagement now = engagement(model, patch, direction);
    if (!now.covered) {
      report.covered = false;
      return;
    }
    const bool engaged = now.engaged_mm2 > 1e-3 * now.area_mm2;
    double step_mm = 0.0;
    if (!engaged) {
      if (report.cutting || cut_before_) {
        report.breakthrough = true;
        break;
      }
      step_mm = std::min(free_mm, std::max(least_mm, 0.8 * now.nearest_mm));
      if (step_mm <= 0.0) break;
    } else {
      report.contact = true;
      report.engaged = now.engaged_mm2 / now.area_mm2;
      report.density_g_cm3 = now.density;
      if (!may_cut) break;
      const RevolutionsPerMinute speed{spindle_rpm};
      FeedLaw law = model.axial ? drilling_law(model.drilling, speed, GramsPerCm3{now.density}, report.engaged)
                                : milling_law(model.milling, speed, now.milling, GramsPerCm3{now.density}, report.engaged);
      // A screw's thread lets it advance by its pitch in a turn, no less for its heel and no more.
      if (model.tool.kind == ToolKind::screw) law.max_feed_mm_per_s = model.tool.thread_pitch_mm * spindle_rpm / 60.0;
      const FeedSolution solution = solve_feed(law, stiffness_n_per_mm, extension_mm, left_s);
      if (!(solution.feed_mm_per_s > 0.0)) break;
      report.cutting = true;
      report.heel_contact = solution.heel_contact;
      report.cutting_force_n = solution.cutting_n * direction;
      report.torque_nmm = (model.axial ? drilling_torque(model.drilling, Newtons{solution.cutting_n})
                                 : milling_torque(model.milling, Newtons{solution.cutting_n})).value();
      // Engagement is asked again before the face has moved half a pitch.
      step_mm = std::min(solution.feed_mm_per_s * left_s, 0.5 * model.fine_pitch_mm);
      left_s -= step_mm / solution.feed_mm_per_s;
      if (left_s < 1e-9) left_s = 0.0;
      cut_mm += step_mm;
      report.cutting_work_mj += solution.cutting_n * step_mm;
    }
    // The shank blocks even where the cutting part goes on; walls no wider than what cuts cannot block along the axis.
    Vec3 by_mm = step_mm * direction;
    bool blocked = false;
    if (!model.axial || model.tool.shank_diameter_mm > model.tool.diameter_mm) by_mm = slide(model, patch, by_mm, false, nullptr, blocked, report.covered);
    if (blocked) report.contact = true;
    pose_.position_mm += by_mm;
    report.moved_mm += by_mm;
    update_sweep();
    extension_mm -= step_mm;
    free_mm -= engaged ? 0.0 : step_mm;
    if (blocked || !report.covered) break;
  }
  report.feed_mm_per_s = cut_mm / dt_s;
}

ProxyStep Proxy::step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_device, double spindle_rpm,
                      double stiffness_n_per_mm, bool may_cut, double dt_s) noexcept {
  ProxyStep report;
  forget_contained(patch);

  // The device's rotation is taken wherever the tool fits with it.
  if (pose_.rotation.angularDistance(pose_bone_device.rotation) > 1e-7) {
    const Pose turned{pose_.position_mm, pose_bone_device.rotation};
    const auto fits = [&](const ContactPoint& point) {
      double before_mm = 0.0, after_mm = 0.0;
      if (!solid(patch, turned.point(point.inset_mm), after_mm)) return false;
      return after_mm >= 0.0 || (solid(patch, pose_.point(point.inset_mm), before_mm) && after_mm >= before_mm);
    };
    if (std::ranges::all_of(model.active, fits) && std::ranges::all_of(model.passive, fits)) pose_ = turned;
  }

  const bool cuts = may_cut && spindle_rpm >= kMinCuttingRpm;
  const Vec3 away_mm = pose_bone_device.position_mm - pose_.position_mm;
  if (model.axial) {
    // Across its axis a drill only blocks; along it, it feeds.
    const Vec3 axis = pose_.direction(Vec3::UnitZ());
    const double along_mm = away_mm.dot(axis);
    travel(model, patch, away_mm - along_mm * axis, &axis, report);
    if (along_mm < 0.0) {
      const Vec3 by_mm = std::max(along_mm, -kMostTravel_mm) * axis;
      pose_.position_mm += by_mm;
      report.moved_mm += by_mm;
    } else if (along_mm > kNothing_mm && report.covered) {
      advance(model, patch, axis, along_mm, spindle_rpm, stiffness_n_per_mm, cuts, dt_s, report);
    }
  } else if (away_mm.norm() > kNothing_mm) {
    const double distance_mm = away_mm.norm();
    if (cuts) {
      advance(model, patch, away_mm / distance_mm, distance_mm, spindle_rpm, stiffness_n_per_mm, true, dt_s, report);
    } else {
      travel(model, patch, away_mm, nullptr, report);
    }
  }
  update_sweep();
  cut_before_ = report.cutting && !report.breakthrough;

  if (cuts && report.covered) {
    for (const ContactPoint& point : model.active) {
      double solid_mm = 0.0;
      if (solid(patch, pose_.point(point.surface_mm), solid_mm) && solid_mm < 0.25 * model.fine_pitch_mm) {
        report.near_bone = true;
        break;
      }
    }
  }
  return report;
}

}  // namespace osteon::haptic
