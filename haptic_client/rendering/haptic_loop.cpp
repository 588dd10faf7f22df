#include "haptic_client/rendering/haptic_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/mechanics/drilling.hpp"
#include "haptic_client/device/haptic_device.hpp"
#include "haptic_client/rendering/slew.hpp"

namespace osteon::haptic {

namespace {

// The skin is most sensitive to vibration from 150 to 300 Hz; a loop of 1 kHz draws the lower end well [A].
constexpr double kCue_hz = 150.0;
constexpr double kHalfCue_mm_per_s = 1.0;  // feed that shakes half as hard as the fastest [A]

}  // namespace

LoopParams loop_params(const DeviceLimits& limits, const ForceScaling& scaling) {
  constexpr double kFullScale_n = 30.0;
  const double force_scale = scaling.scale;
  LoopParams params;
  params.peak_n = limits.peak_n;
  params.continuous_n = limits.continuous_n;
  params.force_scale = force_scale > 0.0 ? force_scale : std::min(1.0, limits.continuous_n / kFullScale_n);
  params.device_n_per_mm = limits.stiffness_n_per_mm;
  params.peak_nmm = limits.peak_nmm;
  params.continuous_nmm = limits.continuous_nmm;
  params.choice = scaling.choice;
  if (scaling.choice == ForceChoice::proportional) return params;
  const bool cue = scaling.choice == ForceChoice::feed_cue;
  const double budget_n = (cue ? kCueShare : 1.0) * limits.continuous_n;
  params.compression = Compression::within(budget_n);
  params.force_scale = std::min(1.0, budget_n / params.compression.of(kFullForce_n));
  params.peak_n = params.continuous_n = budget_n;
  params.peak_nmm = params.continuous_nmm = 0.0;
  if (cue) params.cue_n = limits.continuous_n - budget_n;
  return params;
}

HapticLoop::HapticLoop(const LoopParams& params, std::vector<ToolModel> tools)
    : params_(params),
      tools_(std::move(tools)),
      ready_(tools_.size()),
      ledger_(EnergyParams{.dt_s = params.dt_s, .turn_arm_mm = Proxy::kTurnArm_mm}),
      guide_pull_(guide_pull_params(params.device_n_per_mm, params.continuous_n, params.dt_s)),
      turn_arm_mm_(params.peak_nmm > 0.0 ? Proxy::kTurnArm_mm : 0.0) {
  effects_.reserve(tools_.size());
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    effects_.emplace_back(tools_[i].tool, tools_[i].wear);
    ready_[i] = tools_[i].has_points();
  }
}

void HapticLoop::take_up(int tool, const Pose& pose_rest_tool, const WorkspaceMapping& mapping) noexcept {
  const Pose pose_bone_tool = from_rest(pose_rest_tool);
  tool_ = tool;
  mapping_ = mapping;
  coupling_n_per_mm_ =
      std::min(params_.stiffness_n_per_mm, params_.device_n_per_mm / (params_.force_scale * mapping.scale()));
  proxy_.place(pose_bone_tool);
  guiding_.release();
  recorder_.end();
  spindle_ = {};
  torque_nmm_ = torque_per_n_ = 0.0;
  coupling_.reset(pose_bone_tool.position_mm, pose_bone_tool.position_mm);
  ledger_.reset();
  motor_.reset();
  guide_pull_.reset();
  partner_contact_.reset();
  partner_n_.setZero();
  if (!effects_.empty()) effects_[static_cast<std::size_t>(tool)].take_up();
  together_n_.setZero();
  shown_ = {};
  motor_nmm_.setZero();
  device_ = pose_bone_tool;
  placed_ = true;
}

void HapticLoop::set_wear(int tool, double wear) noexcept {
  tools_[static_cast<std::size_t>(tool)].wear = wear;  // without effects the model's counts
  effects_[static_cast<std::size_t>(tool)].set_wear(wear);
}

void HapticLoop::set_law(int tool, const ForceLaw& law) noexcept { tools_[static_cast<std::size_t>(tool)].law = &law; }

void HapticLoop::see_bone(const Pose& pose_rest_bone) noexcept {
  bone_ = pose_rest_bone;
  moved_ = pose_rest_bone.position_mm != Vec3::Zero() || pose_rest_bone.rotation.vec() != Vec3::Zero();
}

LoopReport HapticLoop::tick(const LoopInput& input, const Patch& patch, std::span<const PlacedGuide> guides) noexcept {
  LoopReport report;
  report.tool = tool_;
  report.pose_rest_bone = bone_;
  report.state_seq = ++ticks_;
  if (tools_.empty()) return report;  // a plan that only waits
  const ToolModel& model = tools_[static_cast<std::size_t>(tool_)];
  if (input.periods > 3) report.events |= kMissedTicks;
  const bool follows = input.room == RoomLink::follows;
  if (!follows) report.events |= kRoomHeld;
  const bool may_work = guard_.may_cut(tool_, proxy_.pose().position_mm);
  if (!may_work) report.events |= kForbidden;
  const bool works = follows && may_work;

  // The spring is attached at handle + offset. Relative to the bone, that point also moves when the bone turns, because
  // the offset does not turn with it. If it did, a hand with much slack would get or lose work that nobody accounts
  // for.
  const Vec3 offset_before_mm = coupling_.offset_mm();
  if (bone_.rotation.coeffs() != bone_before_.rotation.coeffs())
    coupling_.turn(bone_.rotation.conjugate() * bone_before_.rotation);
  const Vec3 left_behind_mm = coupling_.offset_mm() - offset_before_mm;

  // While the clutch is held the tool stays. Releasing the clutch ties the handle to the tool at its present position,
  // without force.
  if (clutched_ && !input.clutch)
    mapping_.anchor(input.pose_device_tool.position_mm, bone_.point(proxy_.pose().position_mm));
  clutched_ = input.clutch;
  Pose pose_bone_device = from_rest(mapping_.pose_bone_tool(input.pose_device_tool));
  if (input.clutch) {
    pose_bone_device = proxy_.pose();
    coupling_.reset(pose_bone_device.position_mm, pose_bone_device.position_mm);
    ledger_.reset();
    device_ = pose_bone_device;
  }
  if (input.device_ok && !device_was_ok_) {
    coupling_.release_all(pose_bone_device.position_mm, proxy_.pose().position_mm);
    ledger_.reset();
    device_ = pose_bone_device;
    ramp_ = 0.0;
  }
  device_was_ok_ = input.device_ok;
  Motion hand = between(device_, pose_bone_device);
  hand.move_mm += left_behind_mm;
  ledger_.observe(hand.move_mm / mapping_.scale(), hand.turn_rad);

  // A guide lets the tool go only where its opening permits. The hand feels the guide as the motion that it prevents.
  Pose pose_bone_wanted = pose_bone_device;
  pose_bone_wanted.position_mm += coupling_.offset_mm();
  bool held_back = false;
  if (const auto guided = guiding_.step(guides, model.tool, pose_bone_wanted, proxy_.pose())) {
    pose_bone_wanted = guided->pose_bone_tool;
    held_back = guided->correction_mm > 0.0;
    report.contact.guide_play_mm = guided->play_mm;
    report.events |= kGuided;
  }

  spindle_.step(model.spindle, works && placed_ ? input.spindle_rpm : 0.0, torque_nmm_, params_.dt_s);
  if (spindle_.stalled) report.events |= kStalled;

  // Limit of the force that is felt and cut with, as physical force.
  const double s = params_.force_scale;
  const Compression& compression = params_.compression;
  const double device_n = compression.inverse((input.device_warm ? params_.continuous_n : params_.peak_n) / s);
  // A decreasing limit starts from all that is felt. Starting from the contact's force alone would at once leave
  // nothing to the guidance spring.
  const double felt_n = shown_.force_n.norm() + guide_pull_.force_n().norm() + partner_n_.norm();
  const double limit_n = guard_.limit_n(device_n, compression.inverse(felt_n / s), slow_n(input) / s);

  const Pose proxy_before = proxy_.pose();
  double paid_n_per_mm = coupling_n_per_mm_;
  ProxyStep step;
  if (!placed_ || patch.version == 0)
    step.covered = false;
  else {
    const bool cuts_waiting = proxy_.sweeps_full() || pieces_.size() >= 60;
    if (cuts_waiting) report.events |= kCutsWaiting;
    // Cutting spends no more than the hand has put in.
    const double at_handle = s / mapping_.scale();
    const double stretch_mm = (pose_bone_wanted.position_mm - proxy_before.position_mm).norm();
    paid_n_per_mm = compression.on()
                        ? compression.paid_n_per_mm(coupling_n_per_mm_, stretch_mm, ledger_.paid_mj() / at_handle)
                        : ledger_.paid_n_per_mm(at_handle * coupling_n_per_mm_, stretch_mm) / at_handle;
    if (limit_n < device_n) paid_n_per_mm = std::min(paid_n_per_mm, limit_n / stretch_mm);
    step = proxy_.step(model, patch, pose_bone_wanted, spindle_.rpm, paid_n_per_mm,
                       works && input.may_cut && !input.clutch && !cuts_waiting, params_.dt_s,
                       {guides, guiding_.held() ? guiding_.guide_id() : 0u,
                        params_.tool_effects ? &effects_[static_cast<std::size_t>(tool_)] : nullptr});
  }
  if (!step.covered) report.events |= kUncovered;
  if (step.heel_contact) report.events |= kHeelContact;
  if (step.on_metal) report.events |= kOnMetal;

  // A path that is still open must not remove returned bone again, and the spindle stands in that bone.
  if (step.returned && recorder_.recording()) {
    recorder_.end();
    proxy_.end_sweep();
  }
  if (step.locked) spindle_ = {};
  record(model, step, report);

  report.pose_bone_proxy = proxy_.pose();
  report.pose_bone_device = pose_bone_device;
  report.cutting.force_n = step.cutting_force_n;
  report.cutting.work_mj = step.cutting_work_mj;
  report.cutting.pushed_back_mj = step.pushed_back_mj;
  report.contact.moved_mm = step.moved_mm;
  report.spindle_rpm = spindle_.rpm;
  report.cutting.feed_mm_per_s = step.feed_mm_per_s;
  report.cutting.density_g_cm3 = step.density_g_cm3;
  report.cutting.engaged = step.engaged;
  report.cutting.torque_nmm = step.torque_nmm;
  report.cutting.across_n = step.across_n;
  report.cutting.out_of_range = step.out_of_range;
  report.cutting.phase = step.cutting         ? CuttingPhase::cutting
                         : step.contact       ? CuttingPhase::rubbing
                         : spindle_.rpm > 1.0 ? CuttingPhase::free
                                              : CuttingPhase::idle;

  // The coupling's spring, as far as the device could show it.
  CouplingMoment moment;
  moment.handle_mm = pose_bone_device.position_mm;
  moment.proxy_before_mm = proxy_before.position_mm;
  moment.proxy_mm = proxy_.pose().position_mm;
  moment.stiffness_n_per_mm = coupling_n_per_mm_;
  moment.limit_n = limit_n;
  moment.energy_scale = s / mapping_.scale();
  moment.compression = compression;
  moment.fell_short = fell_short_;
  moment.touching = (step.contact || step.breakthrough || held_back) && step.covered && !input.clutch;
  // Torque is scaled to the handle as the work of a force is, so that one store holds both. Where the workspace is
  // larger than the bone, levers seem longer.
  moment.stiffness_nmm_per_rad = turn_arm_mm_ * turn_arm_mm_ * coupling_n_per_mm_;
  moment.limit_nmm =
      (input.device_warm ? params_.continuous_nmm : params_.peak_nmm) / moment.energy_scale * (limit_n / device_n);
  if (step.contact) {
    moment.turn_before_rad = between(proxy_before, pose_bone_wanted).turn_rad;
    moment.turn_rad = step.turn_rad;
  }
  const CouplingForce coupling = coupling_.step(moment, step, ledger_, params_.dt_s, params_.smooth_s);
  if (coupling.limited) report.events |= kForceLimited;
  if (coupling.breakthrough) report.events |= kBreakthrough;
  if (coupling.returned) report.events |= kPushedAway;
  report.coupling.force_n = coupling.spring_n;
  report.coupling.offset_mm = coupling_.offset_mm();
  torque_nmm_ = load_nmm(step, moment.touching ? coupling.spring_n.norm() : 0.0);
  report.cutting.wear = params_.tool_effects ? effects_[static_cast<std::size_t>(tool_)].wear() : model.wear;
  report.cutting.law = model.law;
  wear_and_clog(model, step, moment.touching ? coupling.spring_n : Vec3(Vec3::Zero()), input.irrigation, report);
  if (moment.touching) report.coupling.torque_nmm = step.contact_torque_nmm;

  // The spring of the rotation belongs to the coupling. The moment of the cut does not: the bone turns a spindle back
  // and presses on faces beside the tip. Whoever yields to this moment gets the motor's work, not what the hand has put
  // in.
  Vec3 cut_nmm = Vec3::Zero();
  if (step.cutting && moment.touching)
    cut_nmm = step.contact_torque_nmm + paid_n_per_mm * Proxy::kTurnArm_mm * Proxy::kTurnArm_mm * step.turn_rad;
  show(input, model, coupling, moment, cut_nmm, report);
  device_ = pose_bone_device;
  bone_before_ = bone_;
  return report;
}

void HapticLoop::wear_and_clog(const ToolModel& model, const ProxyStep& step, const Vec3& spring_n, bool irrigation,
                               LoopReport& report) noexcept {
  const Vec3 axis = proxy_.pose().direction(Vec3::UnitZ());
  EffectMoment moment;
  moment.spindle_rpm = spindle_.rpm;
  moment.engaged = step.engaged;
  moment.engaged_area_mm2 = step.engaged_area_mm2;
  moment.density_g_cm3 = step.density_g_cm3;
  moment.cutting = step.cutting;
  moment.cutting_n = step.cutting_force_n.norm();
  moment.torque_nmm = step.torque_nmm;
  moment.advance_mm = model.axial ? step.moved_mm.dot(axis) : step.feed_mm_per_s * params_.dt_s;
  moment.push_n = -spring_n.dot(axis);
  moment.irrigation = irrigation;
  // A hand that presses a blade to one side presses its plate on the kerf. The plate's normal is y.
  if (step.engaged > 0.0) moment.kerf_pressure_n = std::abs(spring_n.dot(proxy_.pose().direction(Vec3::UnitY())));
  CuttingEffects& effects = effects_[static_cast<std::size_t>(tool_)];
  effects.step(moment, params_.dt_s);
  report.cutting.flutes_full = effects.clogging().level();
  if (!params_.tool_effects) return;
  report.cutting.blows = static_cast<std::uint32_t>(effects.drive().blows());
  report.cutting.blow_impulse_n_s = effects.drive().impulse_n_s();
  report.cutting.seated = effects.drive().seating();
}

double HapticLoop::load_nmm(const ProxyStep& step, double pressed_n) noexcept {
  const double cutting_n = step.cutting_force_n.norm();
  if (step.cutting && cutting_n > 0.0) torque_per_n_ = step.torque_nmm / cutting_n;
  // Stuck in bone: turning there would take the torque of the thrust that still presses.
  const bool stuck = !step.cutting && spindle_.unloaded_rpm > 1.0 && spindle_.rpm < kMinCuttingRpm;
  return stuck ? torque_per_n_ * pressed_n : step.torque_nmm;
}

void HapticLoop::show(const LoopInput& input, const ToolModel& model, const CouplingForce& coupling,
                      const CouplingMoment& moment, const Vec3& cut_nmm, LoopReport& report) noexcept {
  const Compression& compression = params_.compression;
  const double s = params_.force_scale, limit_n = s * compression.of(moment.limit_n),
               limit_nmm = moment.energy_scale * moment.limit_nmm;
  const bool safe = input.device_ok && input.periods <= 3;
  const double ramp = params_.dt_s / params_.ramp_s;
  ramp_ = std::clamp(input.room == RoomLink::over ? ramp_ - ramp : ramp_ + ramp, 0.0, 1.0);
  if (ramp_ < 1.0) report.events |= kRamping;

  // The hand's own motion may raise the force as fast as it moves, by spring and damping. Everything else raises it
  // only slowly. A rotation counts at its arm.
  Motion hand = between(device_, report.pose_bone_device);
  // The bone's motion is not the hand's: the motion counts from where the bone rests.
  if (moved_) hand = between(bone_before_ * device_, bone_ * report.pose_bone_device);
  const double hand_mm = norm_mm(hand, turn_arm_mm_);
  const double by_hand_n = 2.0 * s * coupling_n_per_mm_ * hand_mm;
  const double slow = slow_n(input);
  const Vec3 before_n = shown_.force_n;
  // A force set to zero for safety, and free air, take effect at once.
  const Vec3 turn_nmm = moment.energy_scale * (coupling.turn_spring_nmm + coupling.turn_damping_nmm);
  Wrench wanted;
  if (moment.touching && safe) {
    wanted.force_n = s * compression.of(Vec3(coupling.spring_n + coupling.damping_n + coupling.cutting_lag_n));
    wanted.force_n = slewed(ramp_ * clamped(wanted.force_n, limit_n), shown_.force_n, by_hand_n + slow, report);
    wanted.torque_nmm = slewed(ramp_ * clamped(turn_nmm, limit_nmm), shown_.torque_nmm,
                               turn_arm_mm_ * (by_hand_n / mapping_.scale() + slow), report);
  }
  const auto share = [](const Vec3& shown, double whole) {
    return whole > 0.0 ? std::min(1.0, shown.norm() / whole) : 0.0;
  };
  // The part of the compressed force that damping causes.
  const Vec3 spring_and_damping_n = compression.of(Vec3(coupling.spring_n + coupling.damping_n));
  const Vec3 damping_n =
      compression.on() ? Vec3(spring_and_damping_n - compression.of(coupling.spring_n)) : coupling.damping_n;
  const Wrench damping{share(wanted.force_n, s * spring_and_damping_n.norm()) * s * damping_n,
                       share(wanted.torque_nmm, turn_nmm.norm()) * moment.energy_scale * coupling.turn_damping_nmm};
  shown_ = ledger_.limited(wanted, damping, moment.touching);
  report.coupling.energy = ledger_.report();
  // Begins with a missed tick, the ramp or the monitor, and lasts until the shown force has come up again. It does not
  // begin where the spring grows faster than force may, as on a point that skates: a hand that presses there would
  // sink.
  constexpr double kClearly = 0.9;  // the filter's lag is less
  fell_short_ = moment.touching && (fell_short_ || !safe || ramp_ < 1.0 || report.coupling.energy.held_back) &&
                shown_.force_n.norm() < kClearly * s * compression.of(coupling.spring_n.norm());
  if (report.coupling.energy.held_back) report.events |= kEnergyLimited;
  report.coupling.device_n = to_device(shown_.force_n);
  report.coupling.device_nmm = to_device(shown_.torque_nmm);

  // The motor port, outside the ledger, within what the limit leaves.
  MotorMoment motor;
  motor.pedal = input.spindle_rpm > 0.0 && input.room == RoomLink::follows && !(report.events & kForbidden) && safe;
  motor.spindle_rpm = spindle_.rpm;
  motor.teeth = model.tool.teeth;
  const double motor_scale = params_.scale_of(coupling.spring_n.norm());
  motor.normal_n = shown_.force_n / motor_scale;
  motor.axis = report.pose_bone_proxy.direction(Vec3::UnitZ());
  motor.cutting = report.cutting.phase == CuttingPhase::cutting;
  motor.across_n = report.cutting.across_n;
  motor.stroke = report.pose_bone_proxy.direction(model.stroke);
  if (params_.tool_effects) motor.pull_n = effects_[static_cast<std::size_t>(tool_)].pull_n();
  Vec3 motor_n = motor_scale * motor_.step(motor, params_.dt_s);
  if (!params_.motor_effects || !safe) motor_n.setZero();
  motor_n = clamped(motor_n, std::max(0.0, limit_n - shown_.force_n.norm()));
  report.motor.device_n = to_device(motor_n);
  // The contact leaves part of the growth that no hand causes. The guidance spring gets that part.
  const double grown_n = growth(shown_.force_n, before_n).norm() - by_hand_n;
  const double room_n = std::max(0.0, limit_n - shown_.force_n.norm() - motor_n.norm());
  lead(input, meet(input, {room_n, std::clamp(slow - grown_n, 0.0, slow), by_hand_n + slow}, report), report);
  together_n_ = report.coupling.device_n + report.guidance.device_n + report.partners.device_n;
  report.cue.device_n = cue_n(report, limit_n, safe);
  report.device.force_n = together_n_ + report.motor.device_n + report.cue.device_n;

  // The same for the moment of the cut, never a force. It is at most what the shown force would be at the arm of a
  // rotation. It grows no faster than force grows that the hand did not cause.
  const double most_nmm = std::min(turn_arm_mm_ * shown_.force_n.norm() / mapping_.scale(),
                                   std::max(0.0, limit_nmm - shown_.torque_nmm.norm()));
  Vec3 motor_nmm = Vec3::Zero();
  if (params_.motor_effects && safe) motor_nmm = ramp_ * motor_.open() * moment.energy_scale * cut_nmm;
  motor_nmm_ = clamped(clamped(motor_nmm, motor_nmm_.norm() + turn_arm_mm_ * slow), most_nmm);
  report.motor.device_nmm = to_device(motor_nmm_);
  report.device.torque_nmm = report.coupling.device_nmm + report.motor.device_nmm;
}

Vec3 HapticLoop::cue_n(const LoopReport& report, double limit_n, bool safe) noexcept {
  if (!(params_.cue_n > 0.0) || !safe || report.cutting.phase != CuttingPhase::cutting) {
    cue_phase_ = 0.0;  // the next vibration begins without a step
    return Vec3::Zero();
  }
  const double feed = std::max(0.0, report.cutting.feed_mm_per_s);
  const double amplitude_n = ramp_ * motor_.open() * params_.cue_n * std::min(1.0, limit_n / params_.continuous_n) *
                             feed / (feed + kHalfCue_mm_per_s);
  const double now_n = amplitude_n * std::sin(2.0 * std::numbers::pi * cue_phase_);
  cue_phase_ = std::fmod(cue_phase_ + kCue_hz * params_.dt_s, 1.0);
  return to_device(now_n * report.pose_bone_proxy.direction(Vec3::UnitZ()));
}

void HapticLoop::prepare(int tool) {
  const auto index = static_cast<std::size_t>(tool);
  const MutexLock lock(preparing_);
  if (ready(tool)) return;
  tools_[index].make_points();
  if (!touch_points_.empty()) touch_points_[index].emplace(tools_[index].tool);
  ready_[index].store(true, std::memory_order_release);
}

void HapticLoop::feel_partners() {
  const MutexLock lock(preparing_);
  touch_points_.resize(tools_.size());
  for (std::size_t i = 0; i < tools_.size(); ++i)
    if (ready_[i]) touch_points_[i].emplace(tools_[i].tool);
}

HapticLoop::Left HapticLoop::meet(const LoopInput& input, const Left& left, LoopReport& report) noexcept {
  const bool safe = placed_ && input.device_ok && input.periods <= 3 && !input.clutch && input.room != RoomLink::over;
  if (touch_points_.empty() || !safe) {
    partner_contact_.reset();
    partner_n_.setZero();
    return left;
  }
  // A hand whose tool is held by another person has no tool that others could push. That person may hold it from a
  // console and have a hand with another number. And the guiding hand is where this hand is.
  std::array<PartnerTool, PartnerContact::kMost> others;
  std::size_t count = 0;
  const HapticRestrictions& restrictions = guard_.now();
  for (const PartnerTool& partner : partners_)
    if (count < others.size() && !restrictions.taken_by && partner.author != restrictions.guide.value)
      others[count++] = partner;
  const PartnerForce felt = partner_contact_.step(*touch_points_[static_cast<std::size_t>(tool_)],
                                                  report.pose_bone_proxy, std::span(others).first(count), params_.dt_s);
  if (felt.author != 0) report.events |= kPartnerTouched;
  Vec3 wanted_n = to_device(clamped(params_.force_scale * params_.compression.of(felt.force_n), left.room_n));
  const Vec3 grown_n = growth(wanted_n, partner_n_);
  wanted_n += clamped(grown_n, left.slew_n) - grown_n;
  report.partners.device_n = partner_n_ = wanted_n;
  return {std::max(0.0, left.room_n - wanted_n.norm()), std::max(0.0, left.slew_n - grown_n.norm()), left.together_n};
}

void HapticLoop::lead(const LoopInput& input, const Left& left, LoopReport& report) noexcept {
  const HapticRestrictions& restrictions = guard_.now();
  GuideSeen seen = guide_seen_;
  seen.there &= static_cast<bool>(restrictions.guide);
  guide_pull_.see(seen);
  const Vec3& guide_mm = guide_pull_.smoothed_mm();
  GuideMoment moment;
  moment.handle_mm = input.pose_device_tool.position_mm;
  moment.guide_mm = mapping_.pose_device_tool({bone_.point(guide_mm), Eigen::Quaterniond::Identity()}).position_mm;
  moment.share = input.room == RoomLink::over ? 0.0 : restrictions.guide_share;
  moment.room_n = left.room_n;
  moment.slew_n = left.slew_n;
  moment.rest_n = report.coupling.device_n + report.partners.device_n;
  moment.together_n = together_n_;
  moment.together_slew_n = left.together_n;
  moment.safe = placed_ && input.device_ok && input.periods <= 3 && !input.clutch;
  report.guidance.device_n = guide_pull_.step(moment);
  if (!guide_pull_.pulls()) return;
  report.events |= kHandGuided;
  report.guidance.distance_mm = (guide_mm - report.pose_bone_device.position_mm).norm();
}

double HapticLoop::slow_n(const LoopInput& input) const noexcept {
  return params_.slew_n_per_ms * 1e3 * params_.dt_s * input.periods;
}

Vec3 HapticLoop::slewed(const Vec3& wanted, const Vec3& now, double most, LoopReport& report) noexcept {
  const Vec3 step = growth(wanted, now);
  if (step.norm() <= most) return wanted;
  report.events |= kSlewLimited;
  return wanted - step + step * (most / step.norm());
}

void HapticLoop::record(const ToolModel& model, const ProxyStep& step, LoopReport& report) noexcept {
  // A tool that stands on metal cuts nothing until it is drawn back.
  const bool stands = step.on_metal && !step.cutting;
  if (step.near_bone && !stands && !recorder_.recording() && proxy_.begin_sweep(model)) {
    recorder_.begin(proxy_.cut_pose(), model.tool.cutting_length_mm);
    quiet_ticks_ = 0;
    return;
  }
  if (!recorder_.recording()) return;
  // A tool that stands rubs with its points, and its faces are a little within the bone: that is no cut. A path that
  // the room would reject is not recorded either.
  const bool taken = step.may_cut && !stands && guard_.takes(proxy_.cut_pose().position_mm);
  if (taken) recorder_.add(proxy_.cut_pose());
  quiet_ticks_ = step.near_bone ? 0 : quiet_ticks_ + 1;

  const bool over = quiet_ticks_ >= kQuietTicks || !taken;
  if (!recorder_.due() && !over) return;
  CutPiece piece;
  if (recorder_.close(piece)) {
    piece.author_seq = cuts_closed_ + 1;
    piece.tool = tool_;
    piece.spindle_rpm = static_cast<std::uint32_t>(spindle_.rpm);
    piece.closed_tick = static_cast<std::int64_t>(ticks_);
    // There is room, because nothing is cut while the queue is nearly full.
    if (pieces_.try_push(piece)) {
      ++cuts_closed_;
      proxy_.closed(model, piece.author_seq);
    } else {
      report.events |= kCutsWaiting;
    }
  }
  if (over) {
    recorder_.end();
    proxy_.end_sweep();
  }
}

}  // namespace osteon::haptic
