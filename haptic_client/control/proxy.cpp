#include "haptic_client/control/proxy.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "common/field/kernel.hpp"
#include "common/mechanics/drilling.hpp"

namespace osteon::haptic {
namespace {

// Free travel along a direction of cutting in one tick: 2 m/s. The tool follows a faster device a little later.
constexpr double kMostTravel_mm = 2.0;
constexpr int kMostSubSteps = 24;     // of motion that cuts
constexpr int kMostTravelSteps = 10;  // of motion that does not
constexpr int kMostTries = 12;        // poses tried in a tick; a wedged tool gets there a little later
constexpr double kNothing_mm = 1e-6;
// Depth in bone at which a point still counts as outside: the error of a linear step, far below what a hand feels.
constexpr double kSkin_mm = 1e-4;
constexpr double kNoise_mm = 1e-5;  // of distances in floats
constexpr double kFlatField = 0.3;  // a shorter gradient means nothing: samples are clipped there
// Sideways force that a drill's point holds on a slope, per newton along its axis [A]: 17 degrees. Beyond it skates.
constexpr double kBite = 0.3, kSteepest = 3.0, kWholePoint = 0.9;
constexpr double kSkiveSpeed_mm_per_s = 30.0;
constexpr double kMostSkive_mm = 3.0;
// Stiffness with which a hand, and the other beside it, hold the point against that. [A]
constexpr double kHand_n_per_mm = 20.0;
// Play of a tool in its own hole, in insets: points that stand apart around it permit a little more.
constexpr double kPlay = 1.5;
constexpr std::int32_t kNoSweep = -1;
constexpr double kDrawnOut_mm = 1.0;  // in a tick, of a tool that is locked in bone

const ContactPoint& point_at(const ToolModel& model, int i) noexcept {
  const int first = model.contact.first_passive();
  return i < first ? model.active[static_cast<std::size_t>(i)] : model.passive[static_cast<std::size_t>(i - first)];
}
bool is_real(const ToolModel& model, int i) noexcept {
  const int first = model.contact.first_passive();
  return i < first ? i < model.contact.active : i - first < model.contact.passive;
}
// Walls no wider than the cutting part follow a tool along its axis; wider walls meet bone.
bool walls_meet_bone(const ToolModel& model) noexcept {
  return !model.axial || model.tool.shank_diameter_mm > model.tool.diameter_mm ||
         model.tool.kind == ToolKind::outside_reamer;
}
bool skives(ToolKind kind) noexcept {
  return kind == ToolKind::drill || kind == ToolKind::pin || kind == ToolKind::end_drill;
}

// The hole's axis after the tool in it has moved: two points of the axis, each with this much play across it.
Pose with_play(const Pose& hole, const Pose& tool, double arm_mm, double play_mm) noexcept {
  const Vec3 axis = tool.direction(Vec3::UnitZ());
  const auto followed = [&](const Vec3& from, const Vec3& to) {
    const double along_mm = (to - from).dot(axis);
    const Vec3 aside_mm = to - from - along_mm * axis;
    const double size_mm = aside_mm.norm();
    const double share = size_mm > play_mm ? 1.0 - play_mm / size_mm : 0.0;
    return Vec3(from + along_mm * axis + share * aside_mm);
  };
  const Vec3 behind(0, 0, -arm_mm), tip = followed(hole.position_mm, tool.position_mm);
  const Vec3 along = tip - followed(hole.point(behind), tool.point(behind));
  return {tip, (Eigen::Quaterniond::FromTwoVectors(axis, along) * tool.rotation).normalized()};
}

// A group's points, moved out of the tool along their normals. Tool frame.
void places_of(const ContactSet& set, int group, float lift_mm, Lanes (&p)[3]) noexcept {
  const auto from = static_cast<std::size_t>(group * kGroupPoints);
  for (std::size_t i = 0; i < kGroupPoints; ++i) {
    p[0][i] = set.x[from + i] + lift_mm * set.nx[from + i];
    p[1][i] = set.y[from + i] + lift_mm * set.ny[from + i];
    p[2][i] = set.z[from + i] + lift_mm * set.nz[from + i];
  }
}

}  // namespace

Proxy::Proxy() : conditions_(std::make_unique<Conditions>()) {
  for (Sight* sight : {&here_, &there_, &ahead_}) {
    sight->values.make_room(kMostContactPoints);
    sight->hard = std::make_unique<std::uint8_t[]>(kMostContactPoints);
    sight->by = std::make_unique<std::int32_t[]>(kMostContactPoints);
    sight->sweeps = std::make_unique<SweepViews>();
  }
}

void Proxy::place(const Pose& pose_bone_tool) noexcept {
  pose_ = cut_pose_ = pose_bone_tool;
  sweep_count_ = 0;
  sweeping_ = cut_before_ = returned_ = locked_ = skates_ = bitten_ = false;
  skive_mm_.setZero();
  skive_to_mm_.setZero();
}

void Proxy::see_sweeps(const ToolModel& model, const Pose& pose, SweepViews& views) const noexcept {
  const double short_mm = 0.5 * model.inset;
  for (std::size_t s = 0; s < static_cast<std::size_t>(sweep_count_); ++s)
    views[s] = SweepView(sweeps_[s], s > 0 ? &sweeps_[s - 1] : nullptr, pose, short_mm);
}

void Proxy::swept(const SweepViews& views, const Lanes (&p)[3], Lanes& left, Parts& by) const noexcept {
  views[0].left_mm(p, left, by);
  for (int s = 1; s < sweep_count_; ++s) {
    Lanes there;
    Parts part;
    views[static_cast<std::size_t>(s)].left_mm(p, there, part);
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const bool more = there[i] > left[i];
      left[i] = more ? there[i] : left[i];
      by[i] = more ? SweepView::kParts * s + part[i] : by[i];
    }
  }
}

Vec3 Proxy::way_out(const SweepViews& views, const Vec3& p, int by) noexcept {
  return views[static_cast<std::size_t>(by / SweepView::kParts)].way_out(p, by % SweepView::kParts);
}

bool Proxy::begin_sweep(const ToolModel& model) noexcept {
  if (sweep_count_ >= kMostSweeps) return false;
  if (!sweeping_) cut_pose_ = pose_;
  sweeping_ = true;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_++)];
  sweep.shape = &model.outline;
  sweep.own_cut = 0;
  sweep.open = true;
  sweep.from = cut_pose_;
  sweep.reach(cut_pose_);
  return true;
}

void Proxy::closed(const ToolModel& model, std::uint64_t own_cut) noexcept {
  if (!sweeping_) return;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_ - 1)];
  sweep.own_cut = own_cut;
  constexpr double kSameAxis_rad = 1e-6, kSameAxis_mm = 0.02;
  const Vec3 away_mm = cut_pose_.position_mm - sweep.from.position_mm;
  const Vec3 axis = cut_pose_.direction(Vec3::UnitZ());
  if (sweep.shape->open_behind() && cut_pose_.rotation.angularDistance(sweep.from.rotation) < kSameAxis_rad &&
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

void Proxy::update_sweep(const ToolModel& model) noexcept {
  if (!sweeping_) return;
  Sweep& sweep = sweeps_[static_cast<std::size_t>(sweep_count_ - 1)];
  const bool open_behind = sweep.shape->open_behind();
  cut_pose_ = open_behind ? with_play(cut_pose_, pose_, sweep.shape->behind_mm(), kPlay * model.inset) : pose_;
  if (open_behind && (cut_pose_.position_mm - sweep.to.position_mm).dot(cut_pose_.direction(Vec3::UnitZ())) <= 0.0)
    return;
  sweep.reach(cut_pose_);
}

void Proxy::forget_contained(const Patch& patch) noexcept {
  int kept = 0;
  for (int i = 0; i < sweep_count_; ++i) {
    const Sweep& sweep = sweeps_[static_cast<std::size_t>(i)];
    if (sweep.open || sweep.own_cut > patch.own_cuts) sweeps_[static_cast<std::size_t>(kept++)] = sweep;
  }
  sweep_count_ = kept;
}

void Proxy::look(const Tick& tick, const Pose& pose, Against against, Sight& sight) noexcept {
  const ToolModel& model = tick.model;
  const ContactSet& set = model.contact;
  ContactValues& values = sight.values;
  const int groups = set.groups(), first = against == Against::all       ? 0
                                           : against == Against::cutting ? set.active_groups
                                                                         : groups;
  std::fill_n(values.nearest_mm.begin(), first, kLeftOut_mm);
  if (tick.scene) {
    std::fill_n(values.distance_mm.begin(), first * kGroupPoints, kLeftOut_mm);
    std::memset(sight.hard.get(), 0, static_cast<std::size_t>(groups * kGroupPoints));
  }
  values.covered = true;
  sight.deepest_in_bone_mm = kLeftOut_mm;
  if (first < groups) {
    ContactQuery query;
    query.pose_bone_tool = pose;
    bool covered = true;
    if (tick.lift_mm > 0.0 && first == 0) {
      query.lift_mm = tick.lift_mm;
      query.groups = set.active_groups;
      evaluate_contact(tick.patch, set, query, values);
      covered = values.covered;
      query.lift_mm = 0.0;
    }
    query.first_group = tick.lift_mm > 0.0 ? set.active_groups : first;
    query.groups = groups - query.first_group;
    evaluate_contact(tick.patch, set, query, values);
    values.covered &= covered;
  }
  // Bone that was cut since the patch was built is gone.
  const float near_mm = static_cast<float>(0.75 * model.fine_pitch_mm);
  if (sweep_count_ > 0) see_sweeps(model, pose, *sight.sweeps);
  std::fill_n(sight.by.get(), groups * kGroupPoints, kNoSweep);
  for (int group = first; group < groups; ++group) {
    float& nearest = values.nearest_mm[static_cast<std::size_t>(group)];
    if (sweep_count_ > 0 && nearest < near_mm) {
      Lanes p[3], left;
      Parts by;
      places_of(set, group, group < set.active_groups ? static_cast<float>(tick.lift_mm) : 0.0f, p);
      swept(*sight.sweeps, p, left, by);
      nearest = kLeftOut_mm;
      for (std::size_t i = 0; i < kGroupPoints; ++i) {
        const std::size_t at = static_cast<std::size_t>(group * kGroupPoints) + i;
        float& distance = values.distance_mm[at];
        if (!is_real(model, static_cast<int>(at))) {
          distance = kLeftOut_mm;
        } else if (distance < near_mm && left[i] > distance) {
          distance = left[i];
          sight.by[at] = by[i];
        }
        nearest = std::min(nearest, distance);
      }
    }
    sight.deepest_in_bone_mm = std::min(sight.deepest_in_bone_mm, nearest);
  }
  if (tick.scene) see_scene(tick, pose, against, sight);
}

void Proxy::see_scene(const Tick& tick, const Pose& pose, Against, Sight& sight) const noexcept {
  // Deeper than this the item was placed where the tool already was: the tool is let out.
  constexpr float kWithin_mm = 0.25f;
  const ToolModel& model = tick.model;
  ContactValues& values = sight.values;
  for (const PlacedGuide& item : tick.around.items) {
    if (!item.solid || (item.id != 0 && item.id == tick.around.guide)) continue;
    const Pose pose_item_tool = item.pose_bone_guide.inverse() * pose;
    // At most twice: the first pass finds whether the tool is inside the item.
    for (const bool let_out : {true, false}) {
      bool within = false;
      for (int group = 0; group < model.contact.groups() && !within; ++group) {
        const ContactSet::Ball& ball = model.contact.balls[static_cast<std::size_t>(group)];
        if (!item.solid->near(pose_item_tool.point(Vec3(ball.x, ball.y, ball.z)), ball.radius_mm)) continue;
        for (int i = group * kGroupPoints; i < (group + 1) * kGroupPoints && !within; ++i) {
          if (!is_real(model, i)) break;
          double distance_mm = 0.0;
          Vec3 gradient;
          if (!item.solid->sample(pose_item_tool.point(point_at(model, i).inset_mm), distance_mm, gradient)) continue;
          const auto distance = static_cast<float>(distance_mm);
          if (let_out) {
            within = distance < -kWithin_mm;
            continue;
          }
          const auto at = static_cast<std::size_t>(i);
          if (distance >= values.distance_mm[at]) continue;
          const Vec3 out = item.pose_bone_guide.direction(gradient);
          values.distance_mm[at] = distance;
          values.gx[at] = static_cast<float>(out.x());
          values.gy[at] = static_cast<float>(out.y());
          values.gz[at] = static_cast<float>(out.z());
          sight.by[at] = kNoSweep;
          sight.hard[at] = 1;
          values.nearest_mm[static_cast<std::size_t>(group)] =
              std::min(values.nearest_mm[static_cast<std::size_t>(group)], distance);
        }
      }
      if (within) break;
    }
  }
}

void Proxy::add_conditions(const Tick& tick, const Sight& sight, const Pose& pose, const Motion& at, double reach_mm,
                           bool broken_only) noexcept {
  const ToolModel& model = tick.model;
  const int groups = model.contact.groups();
  // Permitted depth of each point: none, or its present depth, a little on its way out.
  const auto floor_mm = [&](int i) {
    const double now = static_cast<double>(here_.values.distance_mm[static_cast<std::size_t>(i)]);
    return now >= 0.0 ? 0.0 : now + std::min(-now, kSkin_mm);
  };
  const auto asked = [&](int i) {
    const double d = static_cast<double>(sight.values.distance_mm[static_cast<std::size_t>(i)]);
    if (!broken_only) return d < reach_mm;
    const double now = static_cast<double>(here_.values.distance_mm[static_cast<std::size_t>(i)]);
    return d < std::min(-kSkin_mm, now) - kNoise_mm;
  };
  const auto visit = [&](const auto& see) {
    for (int group = 0; group < groups; ++group) {
      if (static_cast<double>(sight.values.nearest_mm[static_cast<std::size_t>(group)]) >=
          (broken_only ? 0.0 : reach_mm))
        continue;
      for (int i = group * kGroupPoints; i < (group + 1) * kGroupPoints; ++i)
        if (is_real(model, i) && asked(i)) see(i);
    }
  };
  // Takes them evenly spaced where they are more than there is room for.
  constexpr int kMostAtOnce = Conditions::kMost / 4;
  int found = 0, seen = 0;
  visit([&](int) { ++found; });
  const int every = (found + kMostAtOnce - 1) / kMostAtOnce;
  visit([&](int i) {
    if (every > 1 && seen++ % every != 0) return;
    const auto p = static_cast<std::size_t>(i);
    const ContactPoint& point = point_at(model, i);
    Condition condition;
    if (const int by = sight.by[p]; by != kNoSweep) {
      const double lift_mm = i < model.contact.first_passive() ? tick.lift_mm : 0.0;
      condition.n = pose.direction(way_out(*sight.sweeps, point.inset_mm + lift_mm * point.outward, by));
    } else {
      condition.n = Vec3(sight.values.gx[p], sight.values.gy[p], sight.values.gz[p]);
      if (condition.n.norm() < kFlatField) condition.n = -pose.direction(point.outward);
    }
    condition.m = pose.direction(point.inset_mm).cross(condition.n);
    condition.least_mm = floor_mm(i) - static_cast<double>(sight.values.distance_mm[p]) + condition.n.dot(at.move_mm) +
                         condition.m.dot(at.turn_rad);
    conditions_->add(condition);
  });
}

double Proxy::safe_part(const Tick& tick, const Motion& motion, Against against) const noexcept {
  const ContactSet& set = tick.model.contact;
  const double least_mm = 0.5 * tick.model.fine_pitch_mm, turn = motion.turn_rad.norm();
  if (motion.move_mm.norm() + turn * tick.model.contact.reach_mm <= least_mm) return 1.0;
  double part = 1.0;
  for (int group = against == Against::cutting && !tick.scene ? set.active_groups : 0; group < set.groups(); ++group) {
    const ContactSet::Ball& ball = set.balls[static_cast<std::size_t>(group)];
    const Vec3 centre = pose_.direction(Vec3(ball.x, ball.y, ball.z));
    const double way_mm =
        (motion.move_mm + motion.turn_rad.cross(centre)).norm() + turn * static_cast<double>(ball.radius_mm);
    const double may_mm =
        std::max(least_mm, 0.8 * static_cast<double>(here_.values.nearest_mm[static_cast<std::size_t>(group)]));
    if (way_mm * part > may_mm) part = may_mm / way_mm;
  }
  return part;
}

Motion Proxy::allowed(const Tick& tick, const Motion& piece, Against against, const MotionLimits& limits,
                      ProxyStep& report) noexcept {
  constexpr int kMostHere = 7, kMostSolved = 4;
  const double most_mm = 1.5 * norm_mm(piece, limits.arm_mm) + 1e-3;
  bool held = false;
  conditions_->clear();
  add_conditions(tick, here_, pose_, Motion{}, 1.25 * tick.model.fine_pitch_mm, false);
  Motion motion = least_motion(piece, *conditions_, limits, held);
  for (int attempt = 1; attempt <= kMostHere; ++attempt) {
    const double length_mm = norm_mm(motion, limits.arm_mm);
    if (length_mm > most_mm) motion = (most_mm / length_mm) * motion;
    if (!(length_mm > 1e-9)) break;
    const Pose there = moved(pose_, motion);
    ++tries_;
    look(tick, there, against, there_);
    // The patch does not reach there, so the tool waits for its patch, at the patch's edge. A patch is centred on the
    // tool. So a tool that did not go part of the way would wait for ever.
    if (!there_.values.covered) {
      if (attempt == kMostHere) return {};
      motion = 0.5 * motion;
      continue;
    }
    const int before = conditions_->count();
    add_conditions(tick, there_, there, motion, 0.0, true);
    if (conditions_->count() == before) {
      report.contact |= held;
      report.moved_mm += motion.move_mm;
      pose_ = there;
      std::swap(here_, there_);
      return motion;
    }
    held = true;
    if (attempt < kMostSolved)
      motion = least_motion(piece, *conditions_, limits, held);
    else
      motion = 0.5 * motion;
  }
  report.contact = true;
  return {};
}

void Proxy::travel(const Tick& tick, const Pose& wanted, const Vec3* across, bool move_too,
                   ProxyStep& report) noexcept {
  const MotionLimits limits{.arm_mm = kTurnArm_mm, .may_turn = true, .across = across};
  for (int i = 0; i < kMostTravelSteps && tries_ < kMostTries; ++i) {
    Motion left = between(pose_, wanted);
    if (!move_too) left.move_mm.setZero();
    if (across) left.move_mm -= left.move_mm.dot(*across) * *across;
    if (norm_mm(left, limits.arm_mm) < kNothing_mm) return;
    // First applies all conditions that are near, and takes what they leave of the motion. So what is pressed in does
    // not slow what slides.
    bool held = false;
    conditions_->clear();
    add_conditions(tick, here_, pose_, Motion{}, 1.25 * tick.model.fine_pitch_mm, false);
    const Motion along = least_motion(left, *conditions_, limits, held);
    report.contact |= held;
    if (norm_mm(along, limits.arm_mm) < kNothing_mm) return;
    const double part = safe_part(tick, along, Against::all);
    const Motion done = allowed(tick, part * along, Against::all, limits, report);
    if (part >= 1.0 || norm_mm(done, limits.arm_mm) < kNothing_mm) return;
  }
}

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

void Proxy::cut_towards(Tick& tick, const Pose& wanted, ProxyStep& report) noexcept {
  const ToolModel& model = tick.model;
  if (model.feed == Feeding::along) {
    // Across its axis the tool only blocks; along it, it feeds.
    const Vec3 before = pose_.direction(Vec3::UnitZ());
    Pose beside = wanted;
    const double most_mm = kSkiveSpeed_mm_per_s * tick.dt_s;
    const Vec3 change = skive_to_mm_ - skive_mm_;
    skive_mm_ += change.norm() > most_mm ? Vec3(change * (most_mm / change.norm())) : change;
    skates_ = !bitten_ && !skive_to_mm_.isZero();
    skive_to_mm_.setZero();
    if (tick.around.guide == 0) beside.position_mm += skive_mm_;
    travel(tick, beside, &before, true, report);
    const Vec3 axis = pose_.direction(Vec3::UnitZ());
    const double along_mm = (wanted.position_mm - pose_.position_mm).dot(axis);
    if (along_mm < 0.0) {
      Motion back;
      back.move_mm = std::max(along_mm, -kMostTravel_mm) * axis;
      if (tick.scene) {
        look(tick, pose_, Against::scene, here_);
        allowed(tick, safe_part(tick, back, Against::scene) * back, Against::scene, {.may_turn = false}, report);
      } else {
        pose_.position_mm += back.move_mm;
        report.moved_mm += back.move_mm;
      }
    } else if (along_mm > kNothing_mm) {
      advance(tick, axis, along_mm, report);
    }
    return;
  }
  // Rotation, and the motion of a blade across its flat, goes only as far as bone permits. The path removes what the
  // tool's faces reach. So here the faces themselves block, not the points a little within. Otherwise the tool would
  // creep on through bone.
  if (!(tick.lift_mm > 0.0)) {
    tick.lift_mm = model.inset;
    look(tick, pose_, Against::all, here_);
  }
  Pose turned{pose_.position_mm, wanted.rotation};
  Vec3 away_mm = wanted.position_mm - pose_.position_mm;
  const bool blade = model.feed == Feeding::in_plane;
  if (blade) {
    const Vec3 flat = pose_.direction(Vec3::UnitY());
    turned.position_mm += away_mm.dot(flat) * flat;
  }
  if (norm_mm(between(pose_, turned), kTurnArm_mm) > kNothing_mm) travel(tick, turned, nullptr, true, report);
  away_mm = wanted.position_mm - pose_.position_mm;
  if (blade) {
    const Vec3 flat = pose_.direction(Vec3::UnitY());
    away_mm -= away_mm.dot(flat) * flat;
  }
  const double distance_mm = away_mm.norm();
  const bool went = distance_mm > kNothing_mm && advance(tick, away_mm / distance_mm, distance_mm, report);
  if (report.cutting || report.breakthrough) return;
  // It rubs: it follows the surface.
  if (went) look(tick, pose_, Against::all, here_);
  travel(tick, wanted, nullptr, true, report);
}

bool Proxy::bone_returned(const Tick& tick, const Pose& wanted, ProxyStep& report) noexcept {
  const double deepest_mm = static_cast<double>(here_.deepest_in_bone_mm), pitch_mm = tick.model.fine_pitch_mm;
  if (deepest_mm >= -pitch_mm) {
    returned_ = locked_ = false;
    return false;
  }
  returned_ = report.returned = true;
  locked_ |= deepest_mm <= -0.99 * kBandVoxels * pitch_mm;
  report.locked = locked_;
  if (!locked_) return false;
  // Deeper than the band nothing says which way is out. Every tool comes out along its shank.
  const Vec3 axis = pose_.direction(Vec3::UnitZ());
  const double along_mm = (wanted.position_mm - pose_.position_mm).dot(axis);
  if (along_mm < 0.0) {
    const Vec3 back_mm = std::max(along_mm, -kDrawnOut_mm) * axis;
    pose_.position_mm += back_mm;
    report.moved_mm += back_mm;
  }
  return true;
}

bool Proxy::near_bone(const Tick& tick) noexcept {
  const ToolModel& model = tick.model;
  const float near_mm = static_cast<float>(0.25 * model.fine_pitch_mm);
  ContactQuery query;
  query.pose_bone_tool = pose_;
  query.groups = model.contact.active_groups;
  query.lift_mm = model.inset;
  ContactValues& values = ahead_.values;
  evaluate_contact(tick.patch, model.contact, query, values);
  see_sweeps(model, pose_, *ahead_.sweeps);
  for (int group = 0; group < model.contact.active_groups; ++group) {
    if (values.nearest_mm[static_cast<std::size_t>(group)] >= near_mm) continue;
    if (sweep_count_ == 0) return true;
    Lanes p[3], left;
    Parts by;
    places_of(model.contact, group, static_cast<float>(model.inset), p);
    swept(*ahead_.sweeps, p, left, by);
    for (std::size_t i = 0; i < kGroupPoints; ++i) {
      const std::size_t at = static_cast<std::size_t>(group * kGroupPoints) + i;
      if (is_real(model, static_cast<int>(at)) && std::max(values.distance_mm[at], left[i]) < near_mm) return true;
    }
  }
  return false;
}

void Proxy::note_pushed_back(ProxyStep& report) noexcept {
  const double work_mj = report.cutting_force_n.dot(report.moved_mm);
  if (work_mj >= 0.0) return;
  report.pushed_back_mj = -work_mj;
  report.cutting = report.heel_contact = false;
  report.across_n = 0.0;
  report.out_of_range = 0;
  report.cutting_force_n.setZero();
  cut_moment_nmm_.setZero();
}

ProxyStep Proxy::step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_device, double spindle_rpm,
                      double stiffness_n_per_mm, bool may_cut, double dt_s, const Surroundings& around) noexcept {
  ProxyStep report;
  tries_ = 0;
  forget_contained(patch);
  Tick tick{model, patch, around, stiffness_n_per_mm, spindle_rpm, false, dt_s};
  for (const PlacedGuide& item : around.items) tick.scene |= item.solid && !(item.id != 0 && item.id == around.guide);

  // A tool that cuts in any direction is tested at its faces. Where they are not deep, nothing within them is.
  const bool turns = may_cut && model.feed != Feeding::none && spindle_rpm >= kMinCuttingRpm;
  tick.lift_mm = turns && model.feed != Feeding::along && !returned_ ? model.inset : 0.0;
  look(tick, pose_, Against::all, here_);
  if (tick.lift_mm > 0.0 && static_cast<double>(here_.deepest_in_bone_mm) < tick.lift_mm - model.fine_pitch_mm) {
    tick.lift_mm = 0.0;
    look(tick, pose_, Against::all, here_);
  }
  if (!here_.values.covered) {
    report.covered = false;
    return report;
  }
  cut_moment_nmm_.setZero();
  if (bone_returned(tick, pose_bone_device, report)) {
    cut_before_ = false;
    return report;
  }
  tick.may_cut = report.may_cut = turns && !returned_;
  if (tick.may_cut) {
    cut_towards(tick, pose_bone_device, report);
  } else {
    skive_mm_.setZero();
    travel(tick, pose_bone_device, nullptr, true, report);
  }
  if (tick.may_cut) update_sweep(model);  // else it would creep on through bone by the points' inset, without turning
  cut_before_ = report.cutting && !report.breakthrough;

  note_pushed_back(report);
  report.turn_rad = between(pose_, pose_bone_device).turn_rad;
  report.contact_torque_nmm = cut_moment_nmm_;
  if (report.contact) report.contact_torque_nmm -= stiffness_n_per_mm * kTurnArm_mm * kTurnArm_mm * report.turn_rad;
  if (tick.may_cut) report.near_bone = near_bone(tick);
  if (!report.near_bone) bitten_ = false;
  return report;
}

}  // namespace osteon::haptic
