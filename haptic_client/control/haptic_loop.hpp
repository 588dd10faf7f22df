// One millisecond of touch: device pose in; force, cutting state and cuts out. No clock, thread, log or allocation; the
// caller gives time by calling.
#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/id.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/runtime/spsc_queue.hpp"
#include "haptic_client/control/coupling.hpp"
#include "haptic_client/control/cut_recorder.hpp"
#include "haptic_client/control/guidance_spring.hpp"
#include "haptic_client/control/guiding.hpp"
#include "haptic_client/control/motor_port.hpp"
#include "haptic_client/control/partner_contact.hpp"
#include "haptic_client/control/proxy.hpp"
#include "haptic_client/control/supervision_guard.hpp"
#include "haptic_client/control/workspace_mapping.hpp"

namespace osteon::haptic {

struct DeviceLimits;

struct LoopParams {
  double dt_s = 1e-3;
  double force_scale = 1.0;          // s: rendered = s · physical
  double stiffness_n_per_mm = 50.0;  // K_c of the coupling, physical, where the device is stiff enough for it
  double device_n_per_mm = 60.0;     // k of the device
  double peak_n = 60.0;              // of the device
  double continuous_n = 30.0;        // of the device; the limit while it is warm
  double peak_nmm = 0;               // of the device, torque; 0: it shows none
  double continuous_nmm = 0;
  double slew_n_per_ms = 0.5;  // growth of force that the hand did not cause; on the device
  double smooth_s = 2e-3;      // tau of (7.15), on the cutting force alone
  double ramp_s = 0.3;         // after a device came or was calibrated: from no force to all of it; at the end back
  bool motor_effects = true;
  bool tool_effects = true;  // bluntness, clogging, grab, binding, blows
};

// For a device: s = continuous force / 30 N unless given.
[[nodiscard]] LoopParams loop_params(const DeviceLimits& limits, double force_scale);

// How the room stands to the hand.
enum class RoomLink : std::uint8_t {
  follows,  // it takes cuts
  held,     // silent or far behind: the bone is felt on as it is known, nothing is cut and the spindle runs down
  over,     // gone for good: as held, and the force goes down to none over the ramp
};

struct LoopInput {
  Pose pose_device_tool;     // the handle, device frame
  bool clutch = false;       // held: the tool stays, no force, the handle moves freely
  double spindle_rpm = 0;    // commanded
  bool device_ok = true;     // there, working and calibrated; false: no force
  bool device_warm = false;  // no more than the continuous force
  RoomLink room = RoomLink::follows;
  int periods = 1;  // since the last tick; 1 when on time
};

// Bits of LoopReport::events.
enum LoopEvent : std::uint32_t {
  kUncovered = 1,     // no patch round the tool: no force, the tool stays
  kForceLimited = 2,  // the device's limit cut the force
  kSlewLimited = 4,
  kCutsWaiting = 8,  // too many cuts wait for the replica: the tool rubs until it follows
  kMissedTicks = 16,
  kHeelContact = 32,
  kGuided = 64,           // a guide holds the tool
  kStalled = 128,         // the spindle stands under its load
  kBreakthrough = 256,    // what was cut has ended: the coupling's stretch was let go
  kPushedAway = 512,      // bone that came back, or what turned it, moved the tool from the handle: that became offset
  kEnergyLimited = 1024,  // the passivity monitor cut the force
  kRamping = 2048,        // after connecting, or as the room is over
  kRoomHeld = 4096,       // the room takes no cuts: the spindle stands
  kForbidden = 8192,      // an instructor does not let this tool cut here now: the spindle stands
  kHandGuided = 16384,    // another's hand leads this one
  kPartnerTouched = 32768,  // another's tool pushes this one
  kOnMetal = 65536,         // metal is in the way of the turning tool: it cuts nothing
};
// Bits up to the last of them.
inline constexpr std::size_t kLoopEvents = std::bit_width(std::uint32_t{kOnMetal});

struct LoopReport {
  Vec3 force_device_n = Vec3::Zero();    // to write to the device, device frame
  Vec3 force_physical_n = Vec3::Zero();  // of the bone on the tool, bone frame; not scaled, within the device's limit
  Vec3 cutting_force_n = Vec3::Zero();   // of the tool on the bone, the law's part, bone frame
  double cutting_work_mj = 0;            // of that force over the way cut in this tick, physical
  double pushed_back_mj = 0;  // that a cut's force would have given the tool in a tick that turning undid; not shown
  Vec3 coupling_device_n = Vec3::Zero();    // what of force_device_n is the coupling's: passive
  Vec3 motor_device_n = Vec3::Zero();       // of the motor: active, within s · mu · normal force
  Vec3 guide_device_n = Vec3::Zero();       // of a hand that leads this one: what that one's motion pays for
  Vec3 partner_device_n = Vec3::Zero();     // the rest, of others' tools that touch this one
  Vec3 torque_physical_nmm = Vec3::Zero();  // of the bone on the tool about its tip, bone frame; not scaled
  Vec3 torque_device_nmm = Vec3::Zero();    // to write to a device that shows torque, device frame: the sum of these
  Vec3 coupling_device_nmm = Vec3::Zero();  // of the turn's spring: passive, in the ledger
  Vec3 motor_device_nmm = Vec3::Zero();  // moment of the cut: active, within the coupling's force at the arm of a turn
  Vec3 moved_mm = Vec3::Zero();          // of the proxy in this tick
  Pose pose_bone_proxy, pose_bone_device;
  Pose pose_rest_bone;  // the bone on its mount, seen from where it rests
  Vec3 offset_mm =
      Vec3::Zero();     // of the handle's place, bone frame: slack, and what returned bone would have stretched
  EnergyReport energy;  // of the coupling, at the handle
  double guide_distance_mm = 0;  // while led: from the handle's place to that of the hand that leads it, bone frame
  double guide_play_mm = 0;      // while guided: how far the tip may be off the opening's middle
  double spindle_rpm = 0, feed_mm_per_s = 0, density_g_cm3 = 0, engaged = 0, torque_nmm = 0;
  double across_n = 0;        // of the law, across the feed; the hand feels it through the motor's port
  unsigned out_of_range = 0;  // bits of OutOfRange: where the law is used outside what it was made for
  CuttingPhase phase = CuttingPhase::idle;
  int tool = 0;
  std::uint64_t state_seq = 0;  // counts ticks
  std::uint32_t events = 0;
};

class HapticLoop {
 public:
  // `tools`: every tool of the session, ready; a tool is named by its place there.
  HapticLoop(const LoopParams& params, std::vector<ToolModel> tools);

  // [haptic] Takes up a tool in free air, with the handle at a place of the device; by the bone as it rests.
  void take_up(int tool, const Pose& pose_rest_tool, const WorkspaceMapping& mapping) noexcept;
  // [haptic] What holds from the next tick on, until told otherwise.
  void supervise(const HapticRestrictions& oversight) noexcept { guard_.set(oversight); }
  void supervise(const StopFlag& flag) noexcept { guard_.set(flag); }
  void see_guide(const GuideSeen& seen) noexcept { guide_seen_ = seen; }  // of whom the oversight names
  // Where the bone is on its mount, seen from where it rests: there by its own frame. As it rests unless this was
  // called. The mapping is of the place of rest: what follows the bone are contact, forces and poses in reports.
  void see_bone(const Pose& pose_rest_bone) noexcept;
  // Others' tools are felt from now on. Before the first tick, off the haptic thread: it makes points of every tool.
  void feel_partners();
  // [haptic] Where they are; to be there through the next tick. Who leads this hand or holds its tool is not felt.
  void see_partners(std::span<const PartnerTool> partners) noexcept { partners_ = partners; }
  // [haptic] `patch`: the newest there is; `guides`: those that stand on the bone.
  LoopReport tick(const LoopInput& input, const Patch& patch, std::span<const PlacedGuide> guides = {}) noexcept;

  // [replica] Closed cuts in order.
  [[nodiscard]] bool take_piece(CutPiece& piece) noexcept { return pieces_.try_pop(piece); }
  [[nodiscard]] const ToolModel& tool(int index) const { return tools_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] const LoopParams& params() const { return params_; }
  // [haptic]
  [[nodiscard]] const WorkspaceMapping& mapping() const noexcept { return mapping_; }
  [[nodiscard]] std::uint64_t cuts_closed() const noexcept { return cuts_closed_; }
  // [haptic]
  [[nodiscard]] const SupervisionGuard& guard() const noexcept { return guard_; }
  [[nodiscard]] const EnergyReport& guide_energy() const noexcept { return guide_pull_.energy(); }
  // [haptic] K_c of the tool in hand, physical: where the tool moves m mm for each mm of the handle, the device shows
  // m · s · K_c, which its k limits.
  [[nodiscard]] double coupling_n_per_mm() const noexcept { return coupling_n_per_mm_; }

 private:
  [[nodiscard]] Pose from_rest(const Pose& pose_rest) const noexcept {
    return moved_ ? bone_.inverse() * pose_rest : pose_rest;
  }
  [[nodiscard]] Vec3 to_device(const Vec3& bone) const noexcept {
    return mapping_.to_device(moved_ ? bone_.direction(bone) : bone);
  }
  void record(const ToolModel& model, const ProxyStep& step, LoopReport& report) noexcept;
  void wear_and_clog(const ToolModel& model, const ProxyStep& step, const Vec3& spring_n) noexcept;
  [[nodiscard]] double load_nmm(const ProxyStep& step, double pressed_n) noexcept;
  // Force and torque on the handle: the coupling's within ramp, slew limit and energy, and the motor's. `cut_nmm`:
  // moment of the cut, physical.
  void show(const LoopInput& input, const ToolModel& model, const CouplingForce& coupling, const CouplingMoment& moment,
            const Vec3& cut_nmm, LoopReport& report) noexcept;
  // What the contact leaves of limit and slew to forces besides it, and how fast all of them together may grow.
  struct Left {
    double room_n, slew_n, together_n;
  };
  // The pull of another's hand.
  void lead(const LoopInput& input, const Left& left, LoopReport& report) noexcept;
  // What others' tools do to this one; what that leaves.
  Left meet(const LoopInput& input, const Left& left, LoopReport& report) noexcept;
  // Growth of force on the device in this tick that no hand caused.
  [[nodiscard]] double slow_n(const LoopInput& input) const noexcept;
  // A force or torque, `now` what is shown, that rises by no more than `most`.
  [[nodiscard]] static Vec3 slewed(const Vec3& wanted, const Vec3& now, double most, LoopReport& report) noexcept;

  static constexpr int kQuietTicks = 20;  // a path ends when the tool has been off the bone for so long

  LoopParams params_;
  std::vector<ToolModel> tools_;
  std::vector<CuttingEffects> effects_;  // of each tool
  SpscQueue<CutPiece, 64> pieces_;
  WorkspaceMapping mapping_;
  Proxy proxy_;
  Guiding guiding_;
  Spindle spindle_;
  CutRecorder recorder_;
  int tool_ = 0;
  bool placed_ = false, clutched_ = false;
  int quiet_ticks_ = 0;
  double torque_nmm_ = 0;
  double torque_per_n_ = 0;  // of the spindle's load, when it last cut
  double coupling_n_per_mm_ = 0;
  std::uint64_t cuts_closed_ = 0, ticks_ = 0;
  Coupling coupling_;
  EnergyLedger ledger_;
  MotorPort motor_;
  SupervisionGuard guard_;
  GuidanceSpring guide_pull_;
  GuideSeen guide_seen_;
  std::vector<TouchPoints> touch_points_;  // of each tool; none: partners are not felt
  PartnerContact partner_contact_;
  std::span<const PartnerTool> partners_;
  Vec3 partner_n_ = Vec3::Zero();   // shown in the last tick, device frame
  Vec3 together_n_ = Vec3::Zero();  // coupling, pull and others' tools in the last tick, device frame
  Wrench shown_;                    // of the coupling, rendered in the last tick, bone frame
  Vec3 motor_nmm_ = Vec3::Zero();   // of the motor, likewise
  double turn_arm_mm_ = 0;          // of a turn that does work at the handle; zero where no torque is shown
  Pose device_;                     // device in the last tick, bone frame
  Pose bone_, bone_before_;         // seen from where it rests, now and in the last tick
  bool moved_ = false;              // it is not as it rests
  bool device_was_ok_ = true;
  bool fell_short_ = false;  // less was shown in the last tick than the coupling's spring, and not for its growth
  double ramp_ = 0;          // 0 … 1
};

}  // namespace osteon::haptic
