#include "haptic_client/control/haptic_loop.hpp"

#include <algorithm>
#include <cmath>

#include "common/mechanics/drilling.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

LoopParams loop_params(double peak_n, double continuous_n, double stiffness_n_per_mm, double force_scale, double peak_nmm) {
  constexpr double kFullScale_n = 30.0;
  LoopParams params;
  params.peak_n = peak_n;
  params.continuous_n = continuous_n;
  params.force_scale = force_scale > 0.0 ? force_scale : std::min(1.0, continuous_n / kFullScale_n);
  params.device_n_per_mm = stiffness_n_per_mm;
  params.peak_nmm = peak_nmm;
  return params;
}

HapticLoop::HapticLoop(const LoopParams& params, std::vector<ToolModel> tools)
    : params_(params), tools_(std::move(tools)), ledger_(EnergyParams{.dt_s = params.dt_s}) {
  effects_.reserve(tools_.size());
  for (const ToolModel& model : tools_) effects_.emplace_back(model.tool, model.wear);
}

void HapticLoop::take_up(int tool, const Pose& pose_bone_tool, const WorkspaceMapping& mapping) noexcept {
  tool_ = tool;
  mapping_ = mapping;
  coupling_n_per_mm_ = std::min(params_.stiffness_n_per_mm, params_.device_n_per_mm / (params_.force_scale * mapping.scale()));
  proxy_.place(pose_bone_tool);
  guiding_.release();
  recorder_.end();
  spindle_ = {};
  torque_nmm_ = torque_per_n_ = 0.0;
  coupling_.reset(pose_bone_tool.position_mm, pose_bone_tool.position_mm);
  ledger_.reset();
  motor_.reset();
  if (!effects_.empty()) effects_[static_cast<std::size_t>(tool)].take_up();
  force_bone_n_.setZero();
  torque_bone_nmm_.setZero();
  device_mm_ = pose_bone_tool.position_mm;
  placed_ = true;
}

LoopReport HapticLoop::tick(const LoopInput& input, const Patch& patch, std::span<const PlacedGuide> guides) noexcept {
  LoopReport report;
  report.tool = tool_;
  report.state_seq = ++ticks_;
  if (tools_.empty()) return report;  // a plan that only waits
  const ToolModel& model = tools_[static_cast<std::size_t>(tool_)];
  if (input.periods > 3) report.events |= kMissedTicks;

  // While the clutch is held the tool stays; letting go ties the handle to the tool where it now is, without force.
  if (clutched_ && !input.clutch) mapping_.anchor(input.pose_device_tool.position_mm, proxy_.pose().position_mm);
  clutched_ = input.clutch;
  Pose pose_bone_device = mapping_.pose_bone_tool(input.pose_device_tool);
  if (input.clutch) {
    pose_bone_device = proxy_.pose();
    coupling_.reset(pose_bone_device.position_mm, pose_bone_device.position_mm);
    ledger_.reset();
    device_mm_ = pose_bone_device.position_mm;
  }
  if (input.device_ok && !device_was_ok_) {
    coupling_.let_go_all(pose_bone_device.position_mm, proxy_.pose().position_mm);
    ledger_.reset();
    device_mm_ = pose_bone_device.position_mm;
    ramp_ = 0.0;
  }
  device_was_ok_ = input.device_ok;
  ledger_.observe((pose_bone_device.position_mm - device_mm_) / mapping_.scale());

  // A guide lets the tool go only where its opening does; the hand feels the guide as the way that it is kept from.
  Pose pose_bone_wanted = pose_bone_device;
  pose_bone_wanted.position_mm += coupling_.offset_mm();
  bool held_back = false;
  if (const auto guided = guiding_.step(guides, model.tool, pose_bone_wanted, proxy_.pose())) {
    pose_bone_wanted = guided->pose_bone_tool;
    held_back = guided->correction_mm > 0.0;
    report.guide_play_mm = guided->play_mm;
    report.events |= kGuided;
  }

  spindle_.step(model.spindle, input.link_ok && placed_ ? input.spindle_rpm : 0.0, torque_nmm_, params_.dt_s);
  if (spindle_.stalled) report.events |= kStalled;

  const Vec3 proxy_before_mm = proxy_.pose().position_mm;
  ProxyStep step;
  if (!placed_ || patch.version == 0) step.covered = false;
  else {
    const bool cuts_waiting = proxy_.sweeps_full() || pieces_.size() >= 60;
    if (cuts_waiting) report.events |= kCutsWaiting;
    // Cutting spends no more than the hand has put in.
    const double at_handle = params_.force_scale / mapping_.scale();
    const double stretch_mm = (pose_bone_wanted.position_mm - proxy_before_mm).norm();
    const double paid_n_per_mm = ledger_.paid_n_per_mm(at_handle * coupling_n_per_mm_, stretch_mm) / at_handle;
    step = proxy_.step(model, patch, pose_bone_wanted, spindle_.rpm, paid_n_per_mm,
                       input.link_ok && !input.clutch && !cuts_waiting, params_.dt_s,
                       {guides, guiding_.held() ? guiding_.guide_id() : 0u,
                        params_.tool_effects ? &effects_[static_cast<std::size_t>(tool_)] : nullptr});
  }
  if (!step.covered) report.events |= kUncovered;
  if (step.heel_contact) report.events |= kHeelContact;

  // What comes back is not taken again by a path that is still open, and in it the spindle stands.
  if (step.returned && recorder_.recording()) {
    recorder_.end();
    proxy_.end_sweep();
  }
  if (step.locked) spindle_ = {};
  record(model, step, report);

  report.pose_bone_proxy = proxy_.pose();
  report.pose_bone_device = pose_bone_device;
  report.cutting_force_n = step.cutting_force_n;
  report.cutting_work_mj = step.cutting_work_mj;
  report.moved_mm = step.moved_mm;
  report.spindle_rpm = spindle_.rpm;
  report.feed_mm_per_s = step.feed_mm_per_s;
  report.density_g_cm3 = step.density_g_cm3;
  report.engaged = step.engaged;
  report.torque_nmm = step.torque_nmm;
  report.across_n = step.across_n;
  report.out_of_range = step.out_of_range;
  report.phase = step.cutting          ? CuttingPhase::cutting
                 : step.contact        ? CuttingPhase::rubbing
                 : spindle_.rpm > 1.0  ? CuttingPhase::free
                                       : CuttingPhase::idle;

  // The coupling's spring, as far as the device could ever show it.
  const double s = params_.force_scale;
  const double limit_n = input.device_warm ? params_.continuous_n : params_.peak_n;
  CouplingMoment moment;
  moment.handle_mm = pose_bone_device.position_mm;
  moment.proxy_before_mm = proxy_before_mm;
  moment.proxy_mm = proxy_.pose().position_mm;
  moment.stiffness_n_per_mm = coupling_n_per_mm_;
  moment.limit_n = limit_n / s;
  moment.energy_scale = s / mapping_.scale();
  moment.touching = (step.contact || step.breakthrough || held_back) && step.covered && !input.clutch;
  const CouplingForce coupling = coupling_.step(moment, step, ledger_, params_.dt_s, params_.smooth_s);
  if (coupling.limited) report.events |= kForceLimited;
  if (coupling.breakthrough) report.events |= kBreakthrough;
  if (coupling.returned) report.events |= kReturned;
  report.force_physical_n = coupling.spring_n;
  report.offset_mm = coupling_.offset_mm();
  torque_nmm_ = load_nmm(step, moment.touching ? coupling.spring_n.norm() : 0.0);
  wear_and_clog(model, step, moment.touching ? coupling.spring_n : Vec3(Vec3::Zero()));
  if (moment.touching) report.torque_physical_nmm = step.contact_torque_nmm;

  show(input, model, coupling, moment, report);
  device_mm_ = pose_bone_device.position_mm;
  return report;
}

void HapticLoop::wear_and_clog(const ToolModel& model, const ProxyStep& step, const Vec3& spring_n) noexcept {
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
  // A hand that presses a blade to one side presses its plate on the kerf: the plate's normal is y.
  if (step.engaged > 0.0) moment.kerf_pressure_n = std::abs(spring_n.dot(proxy_.pose().direction(Vec3::UnitY())));
  effects_[static_cast<std::size_t>(tool_)].step(moment, params_.dt_s);
}

double HapticLoop::load_nmm(const ProxyStep& step, double pressed_n) noexcept {
  const double cutting_n = step.cutting_force_n.norm();
  if (step.cutting && cutting_n > 0.0) torque_per_n_ = step.torque_nmm / cutting_n;
  // Stuck in bone: to turn there it would take the torque of the thrust that still presses.
  const bool stuck = !step.cutting && spindle_.unloaded_rpm > 1.0 && spindle_.rpm < kMinCuttingRpm;
  return stuck ? torque_per_n_ * pressed_n : step.torque_nmm;
}

void HapticLoop::show(const LoopInput& input, const ToolModel& model, const CouplingForce& coupling, const CouplingMoment& moment,
                      LoopReport& report) noexcept {
  const double s = params_.force_scale, limit_n = s * moment.limit_n;
  const bool safe = input.device_ok && input.link_ok && input.periods <= 3;
  ramp_ = std::min(1.0, ramp_ + params_.dt_s / params_.ramp_s);
  if (ramp_ < 1.0) report.events |= kRamping;

  // Safety zeros and free air come at once.
  Vec3 force_n = Vec3::Zero();
  if (moment.touching && safe) {
    force_n = s * (coupling.spring_n + coupling.damping_n + coupling.cutting_lag_n);
    force_n = slewed(ramp_ * clamped(force_n, limit_n), (moment.handle_mm - device_mm_).norm(), input.periods, report);
  }
  const double whole_n = s * (coupling.spring_n + coupling.damping_n).norm();
  const double share = whole_n > 0.0 ? std::min(1.0, force_n.norm() / whole_n) : 0.0;
  force_bone_n_ = ledger_.limited(force_n, share * s * coupling.damping_n, moment.touching);
  report.energy = ledger_.report();
  if (report.energy.held_back) report.events |= kEnergyLimited;
  report.coupling_device_n = mapping_.to_device(force_bone_n_);

  // The motor's port, beside the ledger, in what the limit leaves.
  MotorMoment motor;
  motor.pedal = input.spindle_rpm > 0.0 && safe;
  motor.spindle_rpm = spindle_.rpm;
  motor.teeth = model.tool.teeth;
  motor.normal_n = force_bone_n_ / s;
  motor.axis = report.pose_bone_proxy.direction(Vec3::UnitZ());
  motor.cutting = report.phase == CuttingPhase::cutting;
  motor.across_n = report.across_n;
  motor.stroke = report.pose_bone_proxy.direction(model.stroke);
  if (params_.tool_effects) motor.pull_n = effects_[static_cast<std::size_t>(tool_)].pull_n();
  Vec3 motor_n = s * motor_.step(motor, params_.dt_s);
  if (!params_.motor_effects || !safe) motor_n.setZero();
  motor_n = clamped(motor_n, std::max(0.0, limit_n - force_bone_n_.norm()));
  report.motor_device_n = mapping_.to_device(motor_n);
  report.force_device_n = report.coupling_device_n + report.motor_device_n;

  // Torque, for a device that shows it; never a force. What the hand did not turn grows slowly, as force does.
  const Vec3 wanted_nmm =
      moment.touching && safe ? clamped(ramp_ * s * report.torque_physical_nmm, params_.peak_nmm) : Vec3(Vec3::Zero());
  const double most_nmm =
      torque_bone_nmm_.norm() + Proxy::kTurnArm_mm * params_.slew_n_per_ms * 1e3 * params_.dt_s * input.periods;
  torque_bone_nmm_ = clamped(wanted_nmm, most_nmm);
  report.torque_device_nmm = mapping_.to_device(torque_bone_nmm_);
}

Vec3 HapticLoop::slewed(const Vec3& wanted_n, double hand_mm, int periods, LoopReport& report) const noexcept {
  // The hand's own movement may raise the force as fast as it moves, spring and damping; everything else only slowly.
  // Lessening what there is comes at once: what counts is the way from the nearest part of the present force.
  const double square = force_bone_n_.squaredNorm();
  const double kept = square > 0.0 ? std::clamp(wanted_n.dot(force_bone_n_) / square, 0.0, 1.0) : 0.0;
  const Vec3 from_n = kept * force_bone_n_, step_n = wanted_n - from_n;
  const double most_n =
      2.0 * params_.force_scale * coupling_n_per_mm_ * hand_mm + params_.slew_n_per_ms * 1e3 * params_.dt_s * periods;
  if (step_n.norm() <= most_n) return wanted_n;
  report.events |= kSlewLimited;
  return from_n + step_n * (most_n / step_n.norm());
}

void HapticLoop::record(const ToolModel& model, const ProxyStep& step, LoopReport& report) noexcept {
  if (step.near_bone && !recorder_.recording() && proxy_.begin_sweep(model)) {
    recorder_.begin(proxy_.cut_pose(), model.tool.cutting_length_mm);
    quiet_ticks_ = 0;
    return;
  }
  if (!recorder_.recording()) return;
  // A tool that stands rubs with its points, its faces a little within the bone: that is no cut.
  if (step.may_cut) recorder_.add(proxy_.cut_pose());
  quiet_ticks_ = step.near_bone ? 0 : quiet_ticks_ + 1;

  const bool over = quiet_ticks_ >= kQuietTicks || !step.may_cut;
  if (!recorder_.due() && !over) return;
  CutPiece piece;
  if (recorder_.close(piece)) {
    piece.author_seq = cuts_closed_ + 1;
    piece.tool = tool_;
    piece.spindle_rpm = static_cast<std::uint32_t>(spindle_.rpm);
    piece.closed_tick = static_cast<std::int64_t>(ticks_);
    // There is room: nothing is cut while the queue is nearly full.
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
