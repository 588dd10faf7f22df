#include "haptic_client/simulation/played_pointer.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "haptic_client/simulation/pointer_session.hpp"

namespace osteon::haptic {

PlayedPointerSession::PlayedPointerSession(ReadyPlan plan, RecordedDevice& device, const ForceScaling& scaling,
                                           double dt_s)
    : plan_(std::move(plan)), device_(device), loop_(pointer_loop(device.limits(), scaling, dt_s), plan_.tools) {
  for (const RecordedTakeUp& taken : device.session().take_ups) loop_.prepare(taken.tool);
  const Pose start = pointer_start(plan_);
  WorkspaceMapping mapping;
  mapping.align(Eigen::Quaterniond::Identity(), 1.0, start.position_mm, start.position_mm);
  loop_.take_up(tool_, start, mapping);
  for (const std::string& name : device.session().laws) laws_.push_back(find_force_law(name));
}

void PlayedPointerSession::take_up(const RecordedTakeUp& taken, SurgeonOrder& order) noexcept {
  WorkspaceMapping mapping;
  mapping.align(taken.view, taken.scale, taken.device_mm, taken.bone_mm);
  tool_ = taken.tool;
  loop_.take_up(tool_, taken.pose_bone_tool, mapping);
  order.hand.target_mm = taken.pose_bone_tool.position_mm;
  order.rotation = taken.pose_bone_tool.rotation;
  order.take_up = true;
}

// The person may have changed both in any tick. Where nobody did, cutting has blunted the tool as in the recording, so
// the values stay the same. A law that does not fit the tool, as of a changed file, is not used.
void PlayedPointerSession::take_wear_and_law(const PointerTick& now) noexcept {
  loop_.set_wear(tool_, now.wear);
  const ForceLaw* law = laws_[now.law];  // check_played() rejects unknown laws
  if (law && law->fits(plan_.tools[static_cast<std::size_t>(tool_)].tool.kind)) loop_.set_law(tool_, *law);
}

SessionTick PlayedPointerSession::tick(const Patch& patch, RoomLink room, int periods,
                                       const std::vector<PlacedGuide>* room_guides) noexcept {
  SessionTick result;
  const DeviceReading reading = device_.read();
  if (const Pose* bone = device_.pose_rest_bone()) loop_.see_bone(*bone);
  const PointerTick* now = device_.pointer_tick();
  if (now && now->take_up >= 0)
    take_up(device_.session().take_ups[static_cast<std::size_t>(now->take_up)], result.order);
  if (now) take_wear_and_law(*now);
  const bool in_hand = now && now->in_hand;
  LoopInput input;
  input.pose_device_tool = reading.pose_device_tool;
  input.clutch = !in_hand;
  input.spindle_rpm = now ? now->commanded_rpm : 0.0;
  input.irrigation = (reading.buttons & kIrrigation) != 0;
  input.device_ok = in_hand;
  input.room = room;
  input.periods = periods;
  input.may_cut = (reading.buttons & kHandCuts) != 0;
  result.order.phase = in_hand ? SurgeonPhase::free_hand : SurgeonPhase::wait;
  result.reading = reading;
  result.commanded_rpm = result.order.spindle_rpm = input.spindle_rpm;
  result.pointer_source = now ? now->source : 0;
  const std::span<const PlacedGuide> guides =
      room_guides ? std::span<const PlacedGuide>(*room_guides) : std::span<const PlacedGuide>();
  result.report = loop_.tick(input, patch, guides);

  StepResult& so_far = results_[0];
  so_far.duration_s += loop_.params().dt_s;
  so_far.completed = so_far.completed || in_hand;
  if (result.report.events & kOnMetal) so_far.on_metal_s += loop_.params().dt_s;
  so_far.peak_force_n = std::max(so_far.peak_force_n, result.report.coupling.force_n.norm());
  return result;
}

}  // namespace osteon::haptic
