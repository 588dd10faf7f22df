#include "haptic_client/control/haptic_loop.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {

LoopParams loop_params(double peak_n, double continuous_n, double stiffness_n_per_mm, double force_scale) {
  constexpr double kFullScale_n = 30.0;
  LoopParams params;
  params.peak_n = peak_n;
  params.continuous_n = continuous_n;
  params.force_scale = force_scale > 0.0 ? force_scale : std::min(1.0, continuous_n / kFullScale_n);
  params.device_n_per_mm = stiffness_n_per_mm;
  return params;
}

HapticLoop::HapticLoop(const LoopParams& params, std::vector<ToolModel> tools) : params_(params), tools_(std::move(tools)) {}

void HapticLoop::take_up(int tool, const Pose& pose_bone_tool, const WorkspaceMapping& mapping) noexcept {
  tool_ = tool;
  mapping_ = mapping;
  coupling_n_per_mm_ = std::min(params_.stiffness_n_per_mm, params_.device_n_per_mm / (params_.force_scale * mapping.scale()));
  proxy_.place(pose_bone_tool);
  guiding_.release();
  recorder_.end();
  spindle_ = {};
  torque_nmm_ = 0.0;
  extension_mm_.setZero();
  force_bone_n_.setZero();
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
  if (input.clutch) pose_bone_device = proxy_.pose();

  // A guide lets the tool go only where its opening does; the hand feels the guide as the way that it is kept from.
  Pose pose_bone_wanted = pose_bone_device;
  bool held_back = false;
  if (const auto guided = guiding_.step(guides, model.tool, pose_bone_device)) {
    pose_bone_wanted = guided->pose_bone_tool;
    held_back = guided->correction_mm > 0.0;
    report.guide_play_mm = guided->play_mm;
    report.events |= kGuided;
  }

  spindle_.step(model.spindle, input.link_ok && placed_ ? input.spindle_rpm : 0.0, torque_nmm_, params_.dt_s);

  ProxyStep step;
  if (!placed_ || patch.version == 0) step.covered = false;
  else {
    const bool cuts_waiting = proxy_.sweeps_full() || pieces_.size() >= 60;
    if (cuts_waiting) report.events |= kCutsWaiting;
    step = proxy_.step(model, patch, pose_bone_wanted, spindle_.rpm, coupling_n_per_mm_,
                       input.link_ok && !input.clutch && !cuts_waiting, params_.dt_s);
  }
  if (!step.covered) report.events |= kUncovered;
  if (step.heel_contact) report.events |= kHeelContact;
  torque_nmm_ = step.torque_nmm;

  record(model, step.near_bone, report);

  report.pose_bone_proxy = proxy_.pose();
  report.pose_bone_device = pose_bone_device;
  report.cutting_force_n = step.cutting_force_n;
  report.moved_mm = step.moved_mm;
  report.spindle_rpm = spindle_.rpm;
  report.feed_mm_per_s = step.feed_mm_per_s;
  report.density_g_cm3 = step.density_g_cm3;
  report.engaged = step.engaged;
  report.torque_nmm = step.torque_nmm;
  report.phase = step.cutting          ? CuttingPhase::cutting
                 : step.contact        ? CuttingPhase::rubbing
                 : spindle_.rpm > 1.0  ? CuttingPhase::free
                                       : CuttingPhase::idle;

  // Physical: the coupling's spring, as far as the device could ever show it.
  const double s = params_.force_scale;
  const double limit_n = input.device_warm ? params_.continuous_n : params_.peak_n;
  const bool touching = (step.contact || held_back) && step.covered && !input.clutch;
  const Vec3 extension_mm = pose_bone_device.position_mm - proxy_.pose().position_mm;
  if (touching) report.force_physical_n = -coupling_n_per_mm_ * extension_mm;
  if (s * report.force_physical_n.norm() > limit_n) {
    report.force_physical_n *= limit_n / (s * report.force_physical_n.norm());
    report.events |= kForceLimited;
  }

  // Safety zeros and free air come at once.
  if (touching && input.device_ok && input.link_ok && input.periods <= 3) {
    force_bone_n_ = rendered_force(extension_mm, limit_n, input.periods, report);
  } else {
    force_bone_n_.setZero();
    extension_mm_ = extension_mm;
  }
  device_mm_ = pose_bone_device.position_mm;
  report.force_device_n = mapping_.to_device(force_bone_n_);
  return report;
}

Vec3 HapticLoop::rendered_force(const Vec3& extension_mm, double limit_n, int periods, LoopReport& report) noexcept {
  const double s = params_.force_scale;
  const Vec3& spring_n = report.force_physical_n;
  // With the damping k_c·T that a sampled spring needs, never more than the spring, so that it cannot pull.
  const Vec3 rate_mm_per_s = (extension_mm - extension_mm_) / params_.dt_s;
  extension_mm_ = extension_mm;
  Vec3 damping_n = -coupling_n_per_mm_ * params_.dt_s * rate_mm_per_s;
  if (damping_n.norm() > spring_n.norm()) damping_n *= spring_n.norm() / damping_n.norm();
  Vec3 force_n = s * (spring_n + damping_n);
  if (force_n.norm() > limit_n) force_n *= limit_n / force_n.norm();

  // The hand's own movement may raise the force as fast as it moves; everything else only slowly.
  const double before_n = force_bone_n_.norm();
  const double hand_mm = (extension_mm + proxy_.pose().position_mm - device_mm_).norm();
  const double by_hand_n = 2.0 * s * coupling_n_per_mm_ * hand_mm;  // spring and damping
  const double most_n = before_n + by_hand_n + params_.slew_n_per_ms * 1e3 * params_.dt_s * periods;
  if (force_n.norm() > most_n) {
    force_n *= most_n / force_n.norm();
    report.events |= kSlewLimited;
  }
  return force_n;
}

void HapticLoop::record(const ToolModel& model, bool near_bone, LoopReport& report) noexcept {
  if (near_bone && !recorder_.recording() && proxy_.begin_sweep(model)) {
    recorder_.begin(proxy_.pose(), model.tool.cutting_length_mm);
    quiet_ticks_ = 0;
    return;
  }
  if (!recorder_.recording()) return;
  recorder_.add(proxy_.pose());
  quiet_ticks_ = near_bone ? 0 : quiet_ticks_ + 1;

  const bool over = quiet_ticks_ >= kQuietTicks;
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
