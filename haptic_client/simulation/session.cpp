#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic {

namespace {
LoopParams params_of(const DeviceLimits& limits, const ForceScaling& scaling, double dt_s) {
  LoopParams params = loop_params(limits, scaling);
  params.dt_s = dt_s;
  return params;
}
}  // namespace

SimulatedSession::SimulatedSession(ReadyPlan plan, const SimulatedDeviceParams& device, const ForceScaling& scaling,
                                   double dt_s)
    : surgeon_(std::move(plan)),
      device_(device),
      loop_(params_of(device.limits, scaling, dt_s), surgeon_.plan().tools) {}

bool SimulatedSession::done() const noexcept {
  if (surgeon_.done() || !played_ || !played_->over()) return surgeon_.done();
  return phase_ != SurgeonPhase::retract && phase_ != SurgeonPhase::lift && phase_ != SurgeonPhase::wait;
}

SessionTick SimulatedSession::tick(const Patch& patch, RoomLink room, int periods,
                                   const std::vector<PlacedGuide>* room_guides) noexcept {
  const double dt_s = loop_.params().dt_s;
  SessionTick result;
  const DeviceReading from_played = played_ ? played_->read() : DeviceReading();
  if (const Pose* bone = played_ ? played_->pose_rest_bone() : nullptr) loop_.see_bone(*bone);
  result.order = surgeon_.act(last_, dt_s);
  phase_ = result.order.phase;
  if (result.order.phase != SurgeonPhase::done && result.order.phase != SurgeonPhase::wait) {
    const ReadyStep& step = surgeon_.plan().steps[result.order.step];
    if (result.order.take_up) {
      const DeviceLimits limits = device_.limits();
      const LoopParams& params = loop_.params();
      // Bone mm for each mm of the handle at which this device can show the coupling's whole stiffness.
      const double stiff_enough = limits.stiffness_n_per_mm / (params.force_scale * params.stiffness_n_per_mm);
      const WorkspaceMapping mapping = Surgeon::mapping_for(step, limits.workspace_radius_mm, stiff_enough);
      const Pose pose_bone_tool{result.order.hand.target_mm, step.rotation};
      loop_.take_up(step.tool, pose_bone_tool, mapping);
      // On a device that shows less than the physical force, the whole hand is scaled down by the same factor: that of
      // its push.
      const HandParams physical = Surgeon::hand_for(step.plan);
      const HandParams hand = scaled(physical, params.scale_of(physical.push_n), mapping.scale());
      device_.take(hand, mapping.pose_device_tool(pose_bone_tool).position_mm);
    }
    const WorkspaceMapping& mapping = loop_.mapping();
    HandCommand command = result.order.hand;
    command.target_mm = mapping.pose_device_tool({command.target_mm, result.order.rotation}).position_mm;
    command.axis = mapping.to_device(command.axis);
    device_.command(command, mapping.pose_device_tool({Vec3::Zero(), result.order.rotation}).rotation,
                    (result.order.spindle_rpm > 0.0 ? kSpindlePedal : 0u) | result.order.other_hand);
    device_.step(dt_s);
  }

  const DeviceReading reading = played_ ? from_played : device_.read();
  LoopInput input;
  input.pose_device_tool = reading.pose_device_tool;
  input.clutch = (reading.buttons & kClutchButton) != 0;
  input.spindle_rpm = reading.buttons & kSpindlePedal ? result.order.spindle_rpm : 0.0;
  input.irrigation = (reading.buttons & kIrrigation) != 0;
  input.device_ok = reading.usable();
  input.device_warm = reading.status == DeviceStatus::warm;
  input.room = room;
  input.periods = periods;
  const std::vector<PlacedGuide>& own = surgeon_.plan().guides;
  const std::span<const PlacedGuide> guides =
      room_guides ? std::span(*room_guides) : std::span(own).first(surgeon_.guides_placed());
  result.reading = reading;
  result.commanded_rpm = input.spindle_rpm;
  result.report = last_ = loop_.tick(input, patch, guides);
  const DeviceOutput output{result.report.device.force_n, result.report.device.torque_nmm};
  if (played_)
    played_->write(output);
  else
    device_.write(output);
  return result;
}

}  // namespace osteon::haptic
