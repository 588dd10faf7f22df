// The force of a tool on what it removes: how much bone the tool engages, the feed that a force law allows there, and
// the force, torque and power that go with it. Parts of Proxy. The laws are in common/mechanics/.
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/mechanics/drilling.hpp"
#include "haptic_client/contact/proxy_impl.hpp"

namespace osteon::haptic {

Proxy::Engagement Proxy::engagement(const Tick& tick, const Vec3& direction) noexcept {
  const ToolModel& model = tick.model;
  const ContactSet& set = model.contact;
  ContactQuery query;
  query.pose_bone_tool = pose_;
  query.groups = set.active_groups;
  query.density = query.ahead = true;
  query.direction_bone = direction;
  query.least_facing = model.least_facing;
  query.strength = &model.strength;
  // Tests from the inset point along the direction to a quarter pitch ahead of the face. This is never beyond the wall
  // of the tool's own hole. Sides that cut but hardly face forward are tested in front of their own face.
  const double ahead_mm = 0.25 * model.fine_pitch_mm;
  if (model.tool.kind == ToolKind::broach) {
    query.lift_mm = model.inset + ahead_mm;
  } else {
    query.ahead_mm = model.inset + ahead_mm;
    query.most_mm = 2.0 * model.fine_pitch_mm;
  }
  ContactValues& values = ahead_.values;
  Engagement now;
  now.sums = evaluate_contact(tick.patch, set, query, values);
  now.covered = values.covered;
  ContactSums& sums = now.sums;
  if (sweep_count_ > 0 && sums.engaged_mm2 > 0.0) {
    const Vec3 toward = pose_.rotation.conjugate() * direction;
    bool any = false;
    see_sweeps(model, pose_, *ahead_.sweeps);
    for (int group = 0; group < set.active_groups; ++group) {
      if (values.nearest_mm[static_cast<std::size_t>(group)] >= 0.0f) continue;
      Lanes probe[3], left;
      Parts by;
      places_of(set, group, static_cast<float>(query.lift_mm), probe);
      for (std::size_t i = 0; i < kGroupPoints; ++i) {
        const std::size_t p = static_cast<std::size_t>(group * kGroupPoints) + i;
        if (values.distance_mm[p] >= 0.0f) continue;
        const double facing = model.active[std::min(p, model.active.size() - 1)].outward.dot(toward);
        const double reach_mm = std::min(query.ahead_mm / facing, query.most_mm);
        for (int k = 0; k < 3; ++k) probe[k][i] += static_cast<float>(reach_mm * toward[k]);
      }
      swept(*ahead_.sweeps, probe, left, by);
      for (int i = group * kGroupPoints; i < (group + 1) * kGroupPoints; ++i) {
        const auto p = static_cast<std::size_t>(i);
        if (values.distance_mm[p] >= 0.0f || !is_real(model, i)) continue;
        const float left_mm = left[p % kGroupPoints];
        if (left_mm < 0.0f) continue;
        const ContactPoint& point = model.active[p];
        const double facing = point.outward.dot(toward);
        const Vec3 tool_mm = point.inset_mm + query.lift_mm * point.outward;
        // This bone is gone since the patch was built: it does not count.
        any = true;
        values.distance_mm[p] = left_mm;
        const double area = point.area_mm2 * facing, density = static_cast<double>(values.density_g_cm3[p]),
                     arm = static_cast<double>(set.arm_mm[p]);
        const double step = std::min(density, kMostDensity_g_cm3) * (kDensitySteps / kMostDensity_g_cm3);
        const auto below = static_cast<std::size_t>(step);
        const double strength = static_cast<double>(model.strength[below]) +
                                (step - static_cast<double>(below)) *
                                    static_cast<double>(model.strength[below + 1] - model.strength[below]);
        sums.engaged_mm2 -= area;
        sums.turned_area_mm2 -= point.area_mm2;
        sums.edge -= point.edge;
        sums.density_mm2 -= area * density;
        sums.milling -= area / arm * strength;
        sums.arm_mm3 -= area * arm;
        sums.force += area * density * point.outward;
        sums.torque += area * density * tool_mm.cross(point.outward);
      }
    }
    if (any) {
      sums.nearest_mm = static_cast<double>(kLeftOut_mm);
      for (int i = 0; i < set.active_groups * kGroupPoints; ++i)
        sums.nearest_mm =
            std::min(sums.nearest_mm, static_cast<double>(values.distance_mm[static_cast<std::size_t>(i)]));
      sums.engaged_mm2 = std::max(0.0, sums.engaged_mm2);
      sums.milling = std::max(0.0, sums.milling);
    }
  }
  now.metal = sums.engaged_mm2 > 0.0 && tick.patch.has_metal && meets_metal(tick, query);
  LawInputs& in = now.inputs;
  in.spindle_rpm = tick.spindle_rpm;
  in.wear = tick.around.effects ? tick.around.effects->wear() : model.wear;
  if (sums.engaged_mm2 > 0.0) {
    in.density_g_cm3 = std::max(0.0, sums.density_mm2) / sums.engaged_mm2;
    in.engaged = std::min(1.0, sums.engaged_mm2 / sums.area_mm2);
    in.engaged_area_mm2 = sums.engaged_mm2;
    in.milling_sum = sums.milling;
    in.mean_arm_mm = sums.arm_mm3 / sums.engaged_mm2;
    (model.feed == Feeding::in_plane ? in.teeth_engaged : in.edge_length_mm) = std::max(0.0, sums.edge);
    in.directed_density = std::max(0.0, sums.density_mm2) / model.active_area_mm2;
  }
  return now;
}

bool Proxy::meets_metal(const Tick& tick, const ContactQuery& query) const noexcept {
  const ToolModel& model = tick.model;
  const Vec3 toward = pose_.rotation.conjugate() * query.direction_bone;
  for (int group = 0; group < model.contact.active_groups; ++group) {
    if (ahead_.values.nearest_mm[static_cast<std::size_t>(group)] >= 0.0f) continue;
    for (int i = group * kGroupPoints; i < (group + 1) * kGroupPoints && is_real(model, i); ++i) {
      const auto p = static_cast<std::size_t>(i);
      if (ahead_.values.distance_mm[p] >= 0.0f) continue;
      const ContactPoint& point = model.active[p];
      const double reach_mm =
          query.ahead_mm > 0.0 ? std::min(query.ahead_mm / point.outward.dot(toward), query.most_mm) : 0.0;
      if (tick.patch.is_metal(pose_.point(point.inset_mm + query.lift_mm * point.outward + reach_mm * toward)))
        return true;
    }
  }
  return false;
}

void Proxy::note_forces(const Tick& tick, const Engagement& now, const Vec3& direction, double thrust_n,
                        ProxyStep& report) noexcept {
  const ToolModel& model = tick.model;
  report.cutting_force_n = thrust_n * direction;
  report.torque_nmm = model.law->torque_nmm(model.law_tool, now.inputs, thrust_n);
  if (tick.around.effects) report.torque_nmm = tick.around.effects->torque_nmm(report.torque_nmm);
  if (model.law->across_n) report.across_n = model.law->across_n(model.law_tool, now.inputs, thrust_n);
  // Each engaged face bears its share (7.12, 7.14): their moment about the tip, and the spindle's own, which the bone
  // turns back.
  const double along = -pose_.direction(now.sums.force).dot(direction);
  cut_moment_nmm_ = -report.torque_nmm * pose_.direction(Vec3::UnitZ());
  if (along > 0.0) cut_moment_nmm_ += thrust_n / along * pose_.direction(now.sums.torque);
}

void Proxy::note_slope(const Tick& tick, const Vec3& direction, double thrust_n) noexcept {
  // Bone that is met pushes out along its own normal. Where that is not against the feed, it pushes the point down the
  // slope, as far as a hand permits.
  const ContactSet& set = tick.model.contact;
  const ContactValues& values = ahead_.values;
  Vec3 out = Vec3::Zero();
  for (int group = 0; group < set.active_groups; ++group) {
    if (values.nearest_mm[static_cast<std::size_t>(group)] >= 0.0f) continue;
    for (int i = group * kGroupPoints; i < (group + 1) * kGroupPoints; ++i) {
      const auto p = static_cast<std::size_t>(i);
      if (values.distance_mm[p] < 0.0f)
        out += static_cast<double>(set.area_mm2[p]) * Vec3(values.gx[p], values.gy[p], values.gz[p]);
    }
  }
  const double against = -out.dot(direction);
  const Vec3 aside = out + against * direction;
  const double slope = against > 0.0 ? aside.norm() / against : 0.0;
  if (slope > kBite)
    skive_to_mm_ =
        std::min(kMostSkive_mm, (std::min(slope, kSteepest) - kBite) * thrust_n / kHand_n_per_mm) * aside.normalized();
}

bool Proxy::advance(const Tick& tick, const Vec3& direction, double distance_mm, ProxyStep& report) noexcept {
  const ToolModel& model = tick.model;
  const bool walls = walls_meet_bone(model);
  const Against against = walls ? Against::cutting : Against::scene;
  const MotionLimits limits{.arm_mm = kTurnArm_mm, .may_turn = false};
  const double least_mm = 0.25 * model.fine_pitch_mm;
  bool seen = false;
  double extension_mm = distance_mm;
  double free_mm = std::min(distance_mm, kMostTravel_mm);
  double left_s = tick.dt_s;
  double cut_mm = 0.0;
  for (int i = 0; i < kMostSubSteps && extension_mm > 0.0 && left_s > 0.0; ++i) {
    const Engagement now = engagement(tick, direction);
    if (!now.covered) break;  // unknown ahead: the tool waits for its patch
    const bool engaged = now.sums.engaged_mm2 > 1e-3 * now.sums.area_mm2;
    double step_mm = 0.0;
    FeedSolution feed;
    if (!engaged) {
      // A point that skates leaves the slope and meets it again: it has not broken through.
      if ((report.cutting || cut_before_) && !skates_) {
        report.breakthrough = true;
        bitten_ = false;
        break;
      }
      step_mm = std::min(free_mm, std::max(least_mm, 0.8 * now.sums.nearest_mm));
      if (step_mm <= 0.0) break;
    } else {
      report.contact = true;
      report.engaged = now.inputs.engaged;
      report.engaged_area_mm2 = now.inputs.engaged_area_mm2;
      report.density_g_cm3 = now.inputs.density_g_cm3;
      if (now.inputs.engaged >= kWholePoint)
        bitten_ = true;
      else if (skives(model.tool.kind))
        note_slope(tick, direction, tick.stiffness_n_per_mm * extension_mm);
      if (!tick.may_cut) break;
      // As on steel: the coupling's extension is the force, and no law applies.
      if (now.metal) {
        report.on_metal = true;
        break;
      }
      FeedLaw law = model.law->feed_law(model.law_tool, now.inputs);
      if (tick.around.effects) law = tick.around.effects->felt(law);
      const FeedSolution solution = solve_feed(law, tick.stiffness_n_per_mm, extension_mm, left_s);
      if (!(solution.feed_mm_per_s > 0.0)) break;
      feed = solution;
      // Engagement is evaluated again before the face has moved half a pitch.
      step_mm = std::min(solution.feed_mm_per_s * left_s, 0.5 * model.fine_pitch_mm);
      left_s -= step_mm / solution.feed_mm_per_s;
      if (left_s < 1e-9) left_s = 0.0;
    }
    // Walls and the scene block even where the cutting part continues.
    bool blocked = false;
    if (walls || tick.scene) {
      // The step to here has already evaluated the walls.
      if (!seen && tick.scene)
        look(tick, pose_, against, here_);
      else if (!seen)
        std::fill_n(here_.values.nearest_mm.begin(), model.contact.active_groups, kLeftOut_mm);
      seen = true;
      Motion piece;
      piece.move_mm = step_mm * direction;
      const double part = engaged ? 1.0 : safe_part(tick, piece, against);
      ProxyStep found;
      step_mm = allowed(tick, part * piece, against, limits, found).move_mm.dot(direction);
      blocked = found.contact || !(step_mm > 0.0);
      report.contact |= found.contact;
      report.moved_mm += found.moved_mm;
    } else {
      pose_.position_mm += step_mm * direction;
      report.moved_mm += step_mm * direction;
    }
    if (engaged && step_mm > 0.0) {
      report.cutting = true;
      report.heel_contact = feed.heel_contact;
      note_forces(tick, now, direction, feed.cutting_n, report);
      report.out_of_range |= out_of_range(*model.law, model.law_tool, now.inputs, feed.feed_mm_per_s);
      cut_mm += step_mm;
      report.cutting_work_mj += feed.cutting_n * step_mm;
    }
    update_sweep(model);
    extension_mm -= step_mm;
    free_mm -= engaged ? 0.0 : step_mm;
    if (blocked) break;
  }
  report.feed_mm_per_s = cut_mm / tick.dt_s;
  return seen;
}

}  // namespace osteon::haptic
