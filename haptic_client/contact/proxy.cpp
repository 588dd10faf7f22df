#include "haptic_client/contact/proxy.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "common/field/kernel.hpp"
#include "common/mechanics/drilling.hpp"
#include "haptic_client/contact/proxy_impl.hpp"

namespace osteon::haptic {
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
