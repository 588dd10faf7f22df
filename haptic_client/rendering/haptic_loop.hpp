// One millisecond of touch. Takes the device's pose; gives force, cutting state and cuts. It uses no clock, thread, log
// or allocation. The caller gives time by calling it.
#pragma once
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/runtime/spsc_queue.hpp"
#include "haptic_client/contact/guiding.hpp"
#include "haptic_client/contact/partner_contact.hpp"
#include "haptic_client/contact/proxy.hpp"
#include "haptic_client/prediction/cut_recorder.hpp"
#include "haptic_client/rendering/coupling.hpp"
#include "haptic_client/rendering/force_scaling.hpp"
#include "haptic_client/rendering/guidance_spring.hpp"
#include "haptic_client/rendering/motor_port.hpp"
#include "haptic_client/rendering/supervision_guard.hpp"
#include "haptic_client/rendering/workspace_mapping.hpp"

namespace osteon::haptic {

struct DeviceLimits;

struct LoopParams {
  double dt_s = 1e-3;
  double force_scale = 1.0;  // s: rendered = s · physical; with a compression, of small forces
  ForceChoice choice = ForceChoice::proportional;
  Compression compression;           // of the force, before s
  double cue_n = 0.0;                // of the feed cue: largest amplitude of its vibration, on the device
  double stiffness_n_per_mm = 50.0;  // K_c of the coupling, physical, if the device is stiff enough for it
  double device_n_per_mm = 60.0;     // k of the device
  double peak_n = 60.0;              // of the device
  double continuous_n = 30.0;        // of the device; the limit while it is warm
  double peak_nmm = 0;               // of the device, torque; 0: it shows none
  double continuous_nmm = 0;
  double slew_n_per_ms = 0.5;  // growth of force that the hand did not cause, on the device
  double smooth_s = 2e-3;      // tau of (7.15), for the cutting force alone
  // Time from no force to full force after a device was connected or calibrated, and back at the end.
  double ramp_s = 0.3;
  bool motor_effects = true;
  bool tool_effects = true;  // bluntness, clogging, grab, binding, blows

  // Rendered over physical, of a physical force of this size.
  [[nodiscard]] double scale_of(double force_n) const noexcept { return force_scale * compression.share(force_n); }
};

// For a device: s = continuous force / 30 N unless given. The compressed choice shows at most the continuous force, and
// the feed cue both parts within it. Neither shows torque: force and torque would not be one store of energy.
[[nodiscard]] LoopParams loop_params(const DeviceLimits& limits, const ForceScaling& scaling);

// How the room takes this client's cuts.
enum class RoomLink : std::uint8_t {
  follows,  // it takes cuts
  held,     // silent or far behind: the known bone is still felt, nothing is cut and the spindle runs down
  over,     // gone for good: as held, and the force falls to none over the ramp
};

struct LoopInput {
  Pose pose_device_tool;     // the handle, device frame
  bool clutch = false;       // held: the tool stays, no force, the handle moves freely
  double spindle_rpm = 0;    // commanded
  bool device_ok = true;     // connected, working and calibrated; false: no force
  bool device_warm = false;  // show no more than the continuous force
  RoomLink room = RoomLink::follows;
  int periods = 1;          // since the last tick; 1 when on time
  bool irrigation = false;  // the other hand rinses the tool
  bool may_cut = true;      // false: the tool only blocks, even while its spindle turns
};

// Bits of LoopReport::events.
enum LoopEvent : std::uint32_t {
  kUncovered = 1,     // no patch around the tool: no force, the tool stays
  kForceLimited = 2,  // the limit of the device, or of an instructor, cut the force
  kSlewLimited = 4,
  kCutsWaiting = 8,  // too many cuts wait for the replica: the tool rubs until the replica has caught up
  kMissedTicks = 16,
  kHeelContact = 32,
  kGuided = 64,         // a guide holds the tool
  kStalled = 128,       // the spindle stands under its load
  kBreakthrough = 256,  // the bone that was cut has ended: the coupling's extension was released
  // Bone that came back, or the tool's own rotation, pushed the tool from the handle: this became offset.
  kPushedAway = 512,
  kEnergyLimited = 1024,    // the passivity monitor cut the force
  kRamping = 2048,          // after connecting, or because the room is over
  kRoomHeld = 4096,         // the room takes no cuts: the spindle stands
  kForbidden = 8192,        // an instructor does not permit this tool to cut here now: the spindle stands
  kHandGuided = 16384,      // another's handle leads this one
  kPartnerTouched = 32768,  // another's tool pushes this one
  kOnMetal = 65536,         // metal is in the way of the turning tool: nothing is cut
};
// Number of bits up to the last one.
inline constexpr std::size_t kLoopEvents = std::bit_width(std::uint32_t{kOnMetal});

// What one tick came to, grouped by the stage that computes it. The stages are in their order.
// Device forces are scaled, in the device's frame. All else is physical, in the bone's frame.
struct LoopReport {
  std::uint64_t state_seq = 0;  // counts ticks
  int tool = 0;
  std::uint32_t events = 0;  // bits of LoopEvent
  Pose pose_bone_proxy, pose_bone_device;
  Pose pose_rest_bone;  // the bone on its mount, relative to its rest pose
  double spindle_rpm = 0;

  // Where bone and guides let the tool go.
  struct Contact {
    Vec3 moved_mm = Vec3::Zero();  // of the proxy in this tick
    double guide_play_mm = 0;      // while in a guide: permitted distance of the tip from the opening's middle
  } contact;

  // What the tool does to the bone, by its force law.
  struct Cutting {
    CuttingPhase phase = CuttingPhase::idle;
    Vec3 force_n = Vec3::Zero();  // of the tool on the bone
    double work_mj = 0;           // of that force over the path cut in this tick
    double pushed_back_mj = 0;    // work of a cut's force that rotation undid in the same tick; not shown
    double feed_mm_per_s = 0, density_g_cm3 = 0, engaged = 0, torque_nmm = 0;
    double flutes_full = 0;         // share of the flutes that chips fill, after the tick
    double wear = 1.0;              // of the tool, before the tick
    const ForceLaw* law = nullptr;  // of the tool; null: there is none
    double across_n = 0;            // across the feed; the hand feels it through the motor port
    unsigned out_of_range = 0;      // bits of OutOfRange: where the law is used outside its range
    // Of a broach: blows so far, impulse of the newest, and how near it is to being seated, 0 to 1.
    std::uint32_t blows = 0;
    double blow_impulse_n_s = 0, seated = 0;
  } cutting;

  // The spring between handle and proxy: passive, in the energy ledger.
  struct Coupling {
    Vec3 force_n = Vec3::Zero();     // of the bone on the tool, within the device's limit
    Vec3 torque_nmm = Vec3::Zero();  // of the bone on the tool about its tip
    // Of the handle's position: slack, and the extension that returned bone would have caused.
    Vec3 offset_mm = Vec3::Zero();
    Vec3 device_n = Vec3::Zero();    // its part of device.force_n
    Vec3 device_nmm = Vec3::Zero();  // its part of device.torque_nmm, of the rotation's spring
    EnergyReport energy;             // at the handle
  } coupling;

  // What the motor adds: active, outside the energy ledger.
  struct Motor {
    Vec3 device_n = Vec3::Zero();    // within s · mu · normal force
    Vec3 device_nmm = Vec3::Zero();  // moment of the cut, within the coupling's force at the arm of a rotation
  } motor;

  // The feed cue's vibration: active, outside the energy ledger, with zero mean.
  struct Cue {
    Vec3 device_n = Vec3::Zero();
  } cue;

  // Others' tools that touch this one.
  struct Partners {
    Vec3 device_n = Vec3::Zero();
  } partners;

  // The guidance spring, while another's handle leads this one.
  struct Guidance {
    Vec3 device_n = Vec3::Zero();  // paid for by the guiding handle's motion
    double distance_mm = 0;        // from this handle's position to the guiding handle's, bone frame
  } guidance;

  // To write to the device: the sum of the parts above.
  struct Device {
    Vec3 force_n = Vec3::Zero();
    Vec3 torque_nmm = Vec3::Zero();  // for a device that shows torque
  } device;
};

class HapticLoop {
 public:
  // `tools`: every tool of the session. An index in this list names a tool. Models may lack their points.
  HapticLoop(const LoopParams& params, std::vector<ToolModel> tools);
  // Makes the points of a tool that lacks them, in up to 0.4 s. Any thread but the haptic one, also during ticks.
  void prepare(int tool) OSTEON_EXCLUDES(preparing_);
  // Any thread. Only a tool that is ready may be taken up.
  [[nodiscard]] bool ready(int tool) const noexcept {
    return ready_[static_cast<std::size_t>(tool)].load(std::memory_order_acquire);
  }
  // [haptic] Takes up a tool in free air, with the handle at a position of the device. The pose is relative to the bone
  // at rest.
  void take_up(int tool, const Pose& pose_rest_tool, const WorkspaceMapping& mapping) noexcept;
  // [haptic] Takes effect from the next tick on, until the next call.
  void supervise(const HapticRestrictions& restrictions) noexcept { guard_.set(restrictions); }
  void supervise(const StopFlag& flag) noexcept { guard_.set(flag); }
  void see_guide(const GuideSeen& seen) noexcept { guide_seen_ = seen; }  // of the person that the restrictions name
  // Pose of the bone on its mount, relative to its rest pose, which is in its own frame. Without a call the bone is at
  // rest. The mapping belongs to the rest pose. Contact, forces and poses in reports follow the bone.
  void see_bone(const Pose& pose_rest_bone) noexcept;
  // From now on others' tools are felt. Call before the first tick, off the haptic thread: it makes points.
  void feel_partners() OSTEON_EXCLUDES(preparing_);
  // [haptic] Poses of others' tools; must stay valid through the next tick. The person who guides this hand or holds
  // its tool is not felt.
  void see_partners(std::span<const PartnerTool> partners) noexcept { partners_ = partners; }
  // [haptic] How blunt a tool is, and the law by which it resists, from the next tick on. The law must fit the tool.
  // Only the resistance to the next feed changes. The spring keeps its extension, so its force does not jump, and the
  // ledger pays for each cut as before. The motor's force stays within the bound of its port.
  void set_wear(int tool, double wear) noexcept;
  void set_law(int tool, const ForceLaw& law) noexcept;
  // [haptic] `patch`: the newest one; `guides`: those on the bone.
  LoopReport tick(const LoopInput& input, const Patch& patch, std::span<const PlacedGuide> guides = {}) noexcept;

  // [replica] Closed cuts in order.
  [[nodiscard]] bool take_piece(CutPiece& piece) noexcept { return pieces_.try_pop(piece); }
  // Any thread, but wear and law of the model are for the haptic thread alone.
  [[nodiscard]] const ToolModel& tool(int index) const { return tools_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] const LoopParams& params() const { return params_; }
  // [haptic]
  [[nodiscard]] const WorkspaceMapping& mapping() const noexcept { return mapping_; }
  [[nodiscard]] std::uint64_t cuts_closed() const noexcept { return cuts_closed_; }
  // [haptic]
  [[nodiscard]] const SupervisionGuard& guard() const noexcept { return guard_; }
  [[nodiscard]] const EnergyReport& guide_energy() const noexcept { return guide_pull_.energy(); }
  // [haptic] K_c of the tool in hand, physical. Where the tool moves m mm for each mm of the handle, the device shows m
  // · s · K_c, which the device's k limits.
  [[nodiscard]] double coupling_n_per_mm() const noexcept { return coupling_n_per_mm_; }

 private:
  [[nodiscard]] Pose from_rest(const Pose& pose_rest) const noexcept {
    return moved_ ? bone_.inverse() * pose_rest : pose_rest;
  }
  [[nodiscard]] Vec3 to_device(const Vec3& bone) const noexcept {
    return mapping_.to_device(moved_ ? bone_.direction(bone) : bone);
  }
  void record(const ToolModel& model, const ProxyStep& step, LoopReport& report) noexcept;
  void wear_and_clog(const ToolModel& model, const ProxyStep& step, const Vec3& spring_n, bool irrigation,
                     LoopReport& report) noexcept;
  [[nodiscard]] double load_nmm(const ProxyStep& step, double pressed_n) noexcept;
  // Force and torque on the handle: the coupling's within ramp, slew limit and energy, and the motor's. `cut_nmm`:
  // moment of the cut, physical.
  void show(const LoopInput& input, const ToolModel& model, const CouplingForce& coupling, const CouplingMoment& moment,
            const Vec3& cut_nmm, LoopReport& report) noexcept;
  // The limit and slew that the contact leaves to other forces, and the permitted growth of all forces together.
  struct Left {
    double room_n, slew_n, together_n;
  };
  // Adds the guidance spring's force.
  void lead(const LoopInput& input, const Left& left, LoopReport& report) noexcept;
  // Adds the force of others' tools. Returns what it leaves.
  Left meet(const LoopInput& input, const Left& left, LoopReport& report) noexcept;
  // The vibration of the feed cue, device frame. `limit_n`: of the shown force, N on the device. An instructor's limit
  // makes the vibration smaller in the same proportion.
  [[nodiscard]] Vec3 cue_n(const LoopReport& report, double limit_n, bool safe) noexcept;
  // Permitted growth of force on the device in this tick that the hand did not cause.
  [[nodiscard]] double slow_n(const LoopInput& input) const noexcept;
  // A force or torque that rises by no more than `most`. `now`: what is shown.
  [[nodiscard]] static Vec3 slewed(const Vec3& wanted, const Vec3& now, double most, LoopReport& report) noexcept;

  static constexpr int kQuietTicks = 20;  // a path ends when the tool has been off the bone for so long

  LoopParams params_;
  std::vector<ToolModel> tools_;          // set_wear() and set_law() change them
  std::vector<CuttingEffects> effects_;   // of each tool
  std::vector<std::atomic<bool>> ready_;  // of each tool: its points are there, and no thread writes them any more
  Mutex preparing_{LockRank::leaf};
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
  std::vector<std::optional<TouchPoints>> touch_points_;  // of each tool that is ready; empty: partners are not felt
  PartnerContact partner_contact_;
  std::span<const PartnerTool> partners_;
  Vec3 partner_n_ = Vec3::Zero();   // shown in the last tick, device frame
  Vec3 together_n_ = Vec3::Zero();  // coupling, guidance spring and others' tools in the last tick, device frame
  Wrench shown_;                    // of the coupling, as rendered in the last tick, bone frame
  Vec3 motor_nmm_ = Vec3::Zero();   // of the motor, likewise
  double turn_arm_mm_ = 0;          // arm of a rotation that does work at the handle; zero where no torque is shown
  Pose device_;                     // pose of the device in the last tick, bone frame
  Pose bone_, bone_before_;         // relative to its rest pose, now and in the last tick
  bool moved_ = false;              // the bone is not at rest
  bool device_was_ok_ = true;
  double cue_phase_ = 0;  // of the feed cue's vibration, in turns
  // In the last tick less than the coupling's spring was shown, and the slew limit was not the reason.
  bool fell_short_ = false;
  double ramp_ = 0;  // 0 … 1
};

}  // namespace osteon::haptic
