#include "tests/support/stability/supervised_hand.hpp"

#include <algorithm>
#include <cmath>

#include "tests/support/allocation_counter.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

using namespace haptic;

constexpr double kHandPitch_mm = 0.5;
constexpr int kPatchTicks = 10;
constexpr int kServerTicks = 8;  // 120 Hz, nearly

// 30 mm wide, its upper face at z = 0, entered along +z.
Case block() {
  const auto distance = [](const Vec3& p) {
    return std::max({std::abs(p.x()) - 15.0, std::abs(p.y()) - 8.0, -p.z(), p.z() - 12.0});
  };
  return make_bone({{-17, -10, -4}, {17, 10, 14}}, kHandPitch_mm, distance, [](const Vec3&) { return 1.9; });
}

bool touches(const LoopReport& report) {
  return report.cutting.phase == CuttingPhase::rubbing || report.cutting.phase == CuttingPhase::cutting;
}

Vec3 growth(const Vec3& now, const Vec3& before) {
  const double square = before.squaredNorm();
  return now - (square > 0.0 ? std::clamp(now.dot(before) / square, 0.0, 1.0) : 0.0) * before;
}

}  // namespace

OverseenHand::OverseenHand(const OverseenRun& run)
    : run_(run),
      bone_(block()),
      replica_(bone_, BodyId{}),
      room_(bone_, run.delay_ms),
      rotation_(Eigen::Quaterniond::Identity()) {
  const SimulatedDeviceParams device = run.weak ? *find_simulated_device("simulated-3.3N") : SimulatedDeviceParams{};
  LoopParams params = loop_params(device.limits, {0.0, run.choice});
  params.ramp_s = 1e-9;
  params.slew_n_per_ms = run.slew_n_per_ms;
  loop_ =
      std::make_unique<HapticLoop>(params, std::vector<ToolModel>{ToolModel(*find_tool(run.tool), bone_.pitch_mm())});
  loop_->feel_partners();
  const Pose start{{0, 0, -3}, rotation_};
  WorkspaceMapping mapping;
  mapping.align(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), run.weak ? 0.5 : 1.0,
                Vec3::Zero(), start.position_mm);
  loop_->take_up(0, start, mapping);
  device_ = std::make_unique<SimulatedDevice>(device);
  device_->take(scaled(expert_hand(), params.force_scale, mapping.scale()),
                mapping.pose_device_tool(start).position_mm);
  builder_.build(replica_.bodies(), loop_->tool(0), start, patch_);
  command.target_mm = start.position_mm;
  if (!run.mount) return;
  yielding_ = std::make_unique<Yielding>(mount_about(bone_.bounds().centre_mm()));
  for (const std::uint64_t author : {1, 2}) yielding_->server.join(author);
}

void OverseenHand::decide(const Restrictions& supervision) {
  // As in the room: a new lease where the hand may now cut again, or may not cut any more.
  if (now_.stopped != supervision.stopped || now_.taken_by != supervision.taken_by) room_.undo(0), ++epoch_;
  now_ = supervision;
  decided_.push_back({ticks_ + run_.delay_ms, supervision, epoch_});
}

void OverseenHand::undo(int count) {
  const std::uint64_t before = room_.undone();
  room_.undo(count);
  if (room_.undone() > before) undone_due_.push_back(ticks_ + run_.delay_ms);
}

void OverseenHand::hear() {
  InContact none, &count = touches(last_) ? crossed_.in_contact : none;
  for (; !decided_.empty() && decided_.front().due <= ticks_; decided_.pop_front()) {
    const ToolModel tools[] = {loop_->tool(0)};
    const Restrictions& now = decided_.front().supervision;
    loop_->supervise(haptic_restrictions(now, RoomSeq{++decisions_}, decided_.front().epoch, tools));
    count.stopped += now.stopped && !heard_.stopped;
    count.taken += now.taken_by && !heard_.taken_by;
    count.given_back += (!now.taken_by && heard_.taken_by) || (!now.stopped && heard_.stopped);
    count.led += now.guide && !heard_.guide;
    count.released += !now.guide && heard_.guide;
    count.limited += now.force_limit != heard_.force_limit;
    heard_ = now;
  }
  for (; !undone_due_.empty() && undone_due_.front() <= ticks_; undone_due_.pop_front()) ++count.undone;
}

// The messages that arrive, one millisecond of the bone, and the messages to send. The hand's work is computed from the
// force that the device showed and the motion of the tool's position.
void OverseenHand::move_bone() {
  if (!yielding_) return;
  Yielding& bone = *yielding_;
  for (; !bone.up.empty() && bone.up.front().due <= ticks_; bone.up.pop_front())
    (void)bone.server.receive(bone.up.front().author, bone.up.front().push);
  if (ticks_ % kServerTicks == 0) {
    bone.server.step(1e-3 * kServerTicks);
    bone.down.push_back({ticks_ + run_.delay_ms, {bone.server.seen(1), bone.server.seen(2)}});
  }
  for (; !bone.down.empty() && bone.down.front().due <= ticks_; bone.down.pop_front()) {
    bone.mine.see(1, bone.down.front().to[0]);
    bone.other.see(bone.down.front().to[1]);
  }

  const Pose before = bone.mine.pose_rest_bone();
  {
    const AllocationCounter heap;
    bone.mine.step(*loop_, last_);
    crossed_.allocations += heap.count();
  }
  const Vec3& tip_mm = last_.pose_bone_proxy.position_mm;
  const Vec3 carried_mm = bone.mine.pose_rest_bone().point(tip_mm) - before.point(tip_mm);
  bone.by_hand_mj = loop_->mapping().to_bone(coupling_n_).dot(carried_mm) / -loop_->params().force_scale;
  if (touches(last_)) crossed_.carried_mm += carried_mm.norm();

  const Shift from = bone.other.shift();
  bone.other.step(other, 1e-3);
  const Shift to = bone.other.shift();
  bone.put_in_mj += bone.by_hand_mj + other.force_n.dot(to.place_mm - from.place_mm) +
                    other.moment_nmm.dot(to.turn_rad - from.turn_rad);
  crossed_.made_mj = std::max(crossed_.made_mj, -bone.put_in_mj);

  if (const std::optional<MountLoad> push = bone.mine.push()) bone.up.push_back({ticks_ + run_.delay_ms, 1, *push});
  if (ticks_ % kServerTicks == 0) bone.up.push_back({ticks_ + run_.delay_ms, 2, bone.other.push()});
}

LoopReport OverseenHand::tick() {
  hear();
  move_bone();
  ++ticks_;
  const WorkspaceMapping& mapping = loop_->mapping();
  HandCommand device_command = command;
  device_command.target_mm = mapping.pose_device_tool({command.target_mm, rotation_}).position_mm;
  device_command.axis = mapping.to_device(command.axis);
  device_->command(device_command, mapping.pose_device_tool({Vec3::Zero(), rotation_}).rotation,
                   pedal ? kSpindlePedal : 0u);
  device_->step(1e-3);
  const DeviceReading reading = device_->read();
  LoopInput input;
  input.pose_device_tool = reading.pose_device_tool;
  input.spindle_rpm = pedal ? std::max(1000.0, loop_->tool(0).tool.spindle_rpm) : 0.0;
  {
    const AllocationCounter heap;
    loop_->see_guide(guide);
    loop_->see_partners(partners);
    last_ = loop_->tick(input, patch_);
    crossed_.allocations += heap.count();
  }
  device_->write(DeviceOutput{last_.device.force_n, last_.device.torque_nmm});
  see(last_, reading.pose_device_tool.position_mm);
  follow();
  return last_;
}

void OverseenHand::run(int ticks, const std::function<void(const LoopReport&)>& each) {
  for (int i = 0; i < ticks; ++i) {
    const LoopReport report = tick();
    if (each) each(report);
  }
}

void OverseenHand::see(const LoopReport& report, const Vec3& handle_mm) {
  const LoopParams& params = loop_->params();
  const Vec3 moved_mm = seen_ ? Vec3(handle_mm - handle_mm_) : Vec3(Vec3::Zero());
  // The hand's motion raises the coupling's spring and damping, and nothing else. It feels the sum: where one force
  // falls at once, another force that it held back would rise at once.
  const double k = params.force_scale * loop_->coupling_n_per_mm() * loop_->mapping().scale();
  const double by_hand_n = k * (2.0 * moved_mm.norm() + moved_before_mm_);
  const Vec3 together_n = report.coupling.device_n + report.guidance.device_n + report.partners.device_n;
  const double grown_n =
      std::max(growth(report.coupling.device_n, coupling_n_).norm(), growth(together_n, together_n_).norm());
  // Against the intended limit, whatever limit the loop was given.
  constexpr double kSlew_n = 0.5;
  crossed_.step_over_slew = std::max(crossed_.step_over_slew, (grown_n - by_hand_n) / kSlew_n);
  crossed_.fall_n = std::max(crossed_.fall_n, force_n_.norm() - report.device.force_n.norm());

  const double to_bone_mj = report.cutting.work_mj + (yielding_ ? yielding_->by_hand_mj : 0.0);
  episode_mj_ += coupling_n_.dot(moved_mm) + params.force_scale / loop_->mapping().scale() * to_bone_mj;
  const bool touching = touches(report);
  crossed_.touching += touching;
  crossed_.cutting += report.cutting.phase == CuttingPhase::cutting;
  if (!touching && report.coupling.device_n.isZero()) {
    crossed_.worst_mj = std::max(crossed_.worst_mj, episode_mj_);
    episode_mj_ = 0.0;
  }
  crossed_.led_mj = std::max(crossed_.led_mj, loop_->guide_energy().worst_mj);

  coupling_n_ = report.coupling.device_n;
  together_n_ = together_n;
  force_n_ = report.device.force_n;
  handle_mm_ = handle_mm;
  moved_before_mm_ = moved_mm.norm();
  seen_ = true;
}

void OverseenHand::follow() {
  CutPiece piece;
  while (loop_->take_piece(piece)) {
    const Cut cut = cut_of(piece, loop_->tool(0), AuthorId{1}, room_.lease_epoch());
    replica_.add_own(cut);
    room_.send(cut);
    cuts_.push_back(cut);
  }
  room_.tick(replica_);
  if (ticks_ % kPatchTicks != 0) return;
  for (const ChangedLeaves& change : replica_.take_changes())
    builder_.changed(kHandPitch_mm, change.level, change.origins);
  builder_.build(replica_.bodies(), loop_->tool(0), last_.pose_bone_proxy, patch_);
  patch_.own_cuts = replica_.last_own();
  patch_.room_seq = replica_.room_seq();
}

}  // namespace osteon::test
