#include "tests/support/stability/stability.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/core/check.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/stability/delayed_room.hpp"

namespace osteon::test {
namespace {

using namespace haptic;

constexpr double kPitch_mm = 0.5;
constexpr double kRound_s = 10.0;   // then a new hand and a new bone
constexpr double kPatch_s = 0.008;  // between two patches
constexpr double kStallEvery_s = 1.7, kStall_s = 0.006;
constexpr double kThinWall_mm = 1.0;
constexpr double kCavity_mm = 5.0;      // radius of a hollow 4 mm deep
constexpr double kTorqueArm_mm = 50.0;  // for a device with torque: its largest torque over its continuous force

// A block 16 mm wide, entered along +z through z = 0.
Case scene_bone(StabilityScene scene) {
  const double thick = scene == StabilityScene::thin_wall ? kThinWall_mm : 8.0;
  const auto distance = [=](const Vec3& p) {
    const double block = std::max({std::abs(p.x()) - 8.0, std::abs(p.y()) - 8.0, -p.z(), p.z() - thick});
    return scene == StabilityScene::cavity ? std::max(block, kCavity_mm - (p - Vec3(0, 0, -1.0)).norm()) : block;
  };
  const auto density = [=](const Vec3& p) {
    return scene != StabilityScene::drill || p.z() < 2.0 || p.z() > 6.0 ? 1.9 : 0.3;
  };
  return make_bone({{-10, -10, -4}, {10, 10, thick + 6.0}}, kPitch_mm, distance, density);
}

// The intended motion of the hand: smooth, in and out of contact, with pauses and a tremor.
struct Gesture {
  double across_hz[2], press_hz, phase[3], across_mm, off_mm, deep_mm, tremor_mm;

  Gesture(StabilityScene scene, bool rig, double stiffness_n_per_mm, Random& random) {
    across_hz[0] = random.between(0.3, 1.6);
    across_hz[1] = random.between(0.3, 1.6);
    press_hz = random.between(0.4, 2.5);
    for (double& p : phase) p = random.between(0.0, 6.28);
    across_mm = scene == StabilityScene::cavity ? 2.0 : scene == StabilityScene::drill ? 0.0 : 4.0;
    off_mm = scene == StabilityScene::drill ? 1.0 : random.between(0.2, 1.0);
    // A soft hand aims deeper than it gets.
    const double force_n = random.between(2.0, 25.0);
    deep_mm = rig ? force_n / stiffness_n_per_mm : force_n / 5.5;
    if (scene == StabilityScene::drill) deep_mm += 10.0, press_hz = 0.12;
    tremor_mm = random.between(0.0, 0.06);
  }
  // `tip_from_middle_mm`: of the burr.
  [[nodiscard]] Vec3 at(double t, const Vec3& tip_from_middle_mm, bool hollow) const {
    const auto wave = [&](double hz, double shift) { return std::sin(2.0 * std::numbers::pi * hz * t + shift); };
    const double press = 0.5 * (off_mm + deep_mm) * wave(press_hz, phase[2]) + 0.5 * (deep_mm - off_mm);
    const Vec3 tremor(wave(9.0, phase[0]), wave(8.3, phase[1]), wave(9.7, phase[2]));
    const double u = wave(across_hz[0], phase[0]), v = wave(across_hz[1], phase[1]);
    if (!hollow) return Vec3(across_mm * u, across_mm * v, press) + tremor_mm * tremor;
    // Round the inside of a hollow, pressing outwards. The burr's middle is half as far out as the wall.
    return Vec3(0, 0, -1.0) + (kCavity_mm - 2.5 + press) * Vec3(0.9 * u, 0.9 * v, 1.0).normalized() +
           tip_from_middle_mm + tremor_mm * tremor;
  }
};

// The intended tilt of a turning hand: about two axes by up to 15 degrees together, and slightly about a third. It
// yields to torque as a wrist does, with some inertia, damping and stiffness [A].
class Wrist {
 public:
  Wrist(Random& random, double strength) : strength_(strength) {
    for (double& hz : hz_) hz = random.between(0.2, 1.5);
    for (double& p : phase_) p = random.between(0.0, 6.28);
    most_rad_ = random.between(0.03, 0.26);
  }
  // Rotation from upright, bone frame, after a tick under this torque. A rig does not yield.
  Eigen::Quaterniond step(double walked_s, double in, bool rig, const Vec3& torque_nmm, double dt_s) {
    constexpr double kInertia_nmm_s2 = 3.0, kDamping_nmm_s = 150.0, kStiffness_nmm = 3000.0;
    const auto wave = [&](int i) { return std::sin(2.0 * std::numbers::pi * hz_[i] * walked_s + phase_[i]); };
    const Vec3 wish_rad = in * most_rad_ * Vec3(0.7 * wave(0), 0.7 * wave(1), 0.14 * wave(2));  // norm at most 1
    if (!rig) {
      speed_ += dt_s / kInertia_nmm_s2 * (torque_nmm / strength_ - kDamping_nmm_s * speed_ - kStiffness_nmm * off_rad_);
      off_rad_ += dt_s * speed_;
    }
    return turned(wish_rad) * turned(off_rad_);
  }

 private:
  static Eigen::Quaterniond turned(const Vec3& by_rad) { return moved({}, {.turn_rad = by_rad}).rotation; }
  double strength_, hz_[3], phase_[3], most_rad_;
  Vec3 off_rad_ = Vec3::Zero(), speed_ = Vec3::Zero();
};

// Energy and steps, from forces and motions at the handle alone.
class Observer {
 public:
  Observer(StabilityResult& result, const LoopParams& params, double scale, double coupling_n_per_mm)
      : result_(result), params_(params), scale_(scale), coupling_n_per_mm_(coupling_n_per_mm) {}

  void see(const LoopReport& report, const Pose& handle, bool pedal) {
    const Vec3& handle_mm = handle.position_mm;
    const Vec3 moved_mm = first_ ? Vec3(Vec3::Zero()) : Vec3(handle_mm - handle_mm_);
    // A device without torque takes no work from a turn.
    Vec3 turned_rad = Vec3::Zero();
    if (!first_ && params_.peak_nmm > 0.0) {
      const Eigen::AngleAxisd turn(handle.rotation * rotation_.conjugate());
      turned_rad = turn.angle() * turn.axis();
    }
    const double turned_mj = torque_nmm_.dot(turned_rad);
    result_.turned_mj -= turned_mj;
    const double s = params_.force_scale;
    // By the closed form of force_scaling.hpp: work of the force that the hand would feel of this one.
    const double law_n = report.cutting.force_n.norm(), knee_n = params_.compression.knee_n;
    const double felt = knee_n > 0.0 && law_n > 0.0 ? knee_n * std::log(1.0 + law_n / knee_n) / law_n : 1.0;
    const double cut_mj = felt * s / scale_ * report.cutting.work_mj;
    episode_mj_ += force_n_.dot(moved_mm) + turned_mj + cut_mj;
    hand_mj_ += force_n_.dot(moved_mm) + turned_mj;
    result_.cutting_mj += cut_mj;
    result_.least_cutting_n_mm =
        std::min(result_.least_cutting_n_mm, report.cutting.force_n.dot(report.contact.moved_mm));
    result_.pushed_back_most_mj = std::max(result_.pushed_back_most_mj, report.cutting.pushed_back_mj);
    result_.pushed_back += report.cutting.pushed_back_mj > 0.0;

    const Vec3& force_n = report.coupling.device_n;
    const Vec3& torque_nmm = report.coupling.device_nmm;
    const bool touching =
        report.cutting.phase == CuttingPhase::rubbing || report.cutting.phase == CuttingPhase::cutting;
    if (!touching && force_n.isZero() && torque_nmm.isZero())
      finish();
    else
      open_ = true;

    // The hand's motion raises spring and damping: k for each millimetre of this tick, b/T for the increase in speed
    // since the last one.
    const double k = s * coupling_n_per_mm_ * scale_;
    const double at_arm_mm = Proxy::kTurnArm_mm / scale_;  // of a turn, at the handle
    const double moved_by_mm = std::hypot(moved_mm.norm(), at_arm_mm * turned_rad.norm());
    const double by_hand_n = k * (2.0 * moved_by_mm + moved_before_mm_);
    const auto grown = [](const Vec3& now, const Vec3& before) {
      const double square = before.squaredNorm();
      return (now - (square > 0.0 ? std::clamp(now.dot(before) / square, 0.0, 1.0) : 0.0) * before).norm();
    };
    const double step_n = grown(force_n, force_n_);
    const double slew_n = params_.slew_n_per_ms * 1e3 * params_.dt_s;
    result_.step_over_n = std::max(result_.step_over_n, step_n - slew_n - by_hand_n);
    constexpr std::uint32_t kReleased = kBreakthrough | kUncovered | kMissedTicks | kPushedAway;
    if (touching && !(report.events & kReleased)) {
      const double explained_n = slew_n + by_hand_n + 2.0 * s * coupling_n_per_mm_ * report.contact.moved_mm.norm();
      result_.fall_n = std::max(result_.fall_n, force_n_.norm() - force_n.norm() - explained_n);
    }
    constexpr std::uint32_t kLess = kSlewLimited | kEnergyLimited | kRamping | kMissedTicks | kForceLimited;
    still_ = moved_by_mm < 1e-12 && report.contact.moved_mm.isZero() ? still_ + 1 : 0;
    if (still_ > 20 && !(report.events & (kLess | kReleased)) && report.cutting.phase == CuttingPhase::rubbing) {
      const double bone_n = report.coupling.force_n.norm();
      const double shown_n = s * (knee_n > 0.0 ? knee_n * std::log(1.0 + bone_n / knee_n) : bone_n);
      result_.still_off_n = std::max(result_.still_off_n, std::abs(force_n.norm() - shown_n));
      result_.still += bone_n > 1.0;
    }
    if (moved_by_mm < 1e-12 && moved_before_mm_ < 1e-12) result_.still_step_n = std::max(result_.still_step_n, step_n);
    // A turn's spring at its arm is the move's at the handle. The slew limit is at the tool's arm.
    const double turn_step_nmm = grown(torque_nmm, torque_nmm_);
    result_.turn_step_over_n =
        std::max(result_.turn_step_over_n, (turn_step_nmm - at_arm_mm * by_hand_n) / Proxy::kTurnArm_mm - slew_n);
    const double cut_nmm = report.motor.device_nmm.norm();
    result_.cut_step_over_n = std::max(result_.cut_step_over_n, (cut_nmm - cut_nmm_) / Proxy::kTurnArm_mm - slew_n);
    result_.cut_over_nmm = std::max(result_.cut_over_nmm, cut_nmm - at_arm_mm * force_n.norm());
    result_.cut_most_nmm = std::max(result_.cut_most_nmm, cut_nmm);
    result_.torque_most_nmm = std::max(result_.torque_most_nmm, report.device.torque_nmm.norm());
    result_.torque_over_nmm = std::max(result_.torque_over_nmm, report.device.torque_nmm.norm() - params_.peak_nmm);

    const double motor_n = report.motor.device_n.norm();
    result_.motor_over_n = std::max(result_.motor_over_n, motor_n - MotorPortParams{}.friction * force_n.norm());
    result_.motor_most_n = std::max(result_.motor_most_n, motor_n);
    off_s_ = pedal ? 0.0 : off_s_ + params_.dt_s;
    if (off_s_ > 0.010 + 0.5 * params_.dt_s) {
      result_.motor_late_n = std::max(result_.motor_late_n, motor_n);
      result_.cut_late_nmm = std::max(result_.cut_late_nmm, cut_nmm);
    }
    result_.force_most_n = std::max(result_.force_most_n, report.device.force_n.norm());
    result_.cue_most_n = std::max(result_.cue_most_n, report.cue.device_n.norm());
    result_.budget_over_n =
        std::max(result_.budget_over_n, report.device.force_n.norm() - (params_.continuous_n + params_.cue_n));

    ++result_.ticks;
    result_.late += (report.events & kMissedTicks) != 0;
    result_.touching += touching;
    result_.cutting += report.cutting.phase == CuttingPhase::cutting;
    result_.uncovered += (report.events & kUncovered) != 0;
    result_.held_back += (report.events & kEnergyLimited) != 0;
    result_.returned += (report.events & kPushedAway) != 0;
    result_.slew_limited += (report.events & kSlewLimited) != 0;

    force_n_ = force_n;
    torque_nmm_ = torque_nmm;
    cut_nmm_ = cut_nmm;
    handle_mm_ = handle_mm;
    rotation_ = handle.rotation;
    moved_before_mm_ = moved_by_mm;
    first_ = false;
  }
  void finish() {
    if (!open_) {
      episode_mj_ = hand_mj_ = 0.0;
      return;
    }
    open_ = false;
    ++result_.episodes;
    result_.net_mj += episode_mj_;
    result_.generated_mj += std::max(0.0, episode_mj_);
    result_.worst_mj = std::max(result_.worst_mj, episode_mj_);
    result_.hand_worst_mj = std::max(result_.hand_worst_mj, hand_mj_);
    episode_mj_ = hand_mj_ = 0.0;
  }

 private:
  StabilityResult& result_;
  LoopParams params_;
  double scale_, coupling_n_per_mm_;
  Vec3 force_n_ = Vec3::Zero(), torque_nmm_ = Vec3::Zero(), handle_mm_ = Vec3::Zero();
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  double moved_before_mm_ = 0, cut_nmm_ = 0, episode_mj_ = 0, hand_mj_ = 0, off_s_ = 0;
  int still_ = 0;  // ticks in which neither handle nor tool moved
  bool open_ = false, first_ = true;
};

// One hand at one bone.
class Round {
 public:
  Round(const StabilityRun& run, int number, StabilityResult& result)
      : run_(run),
        result_(result),
        random_(run.seed * 1000 + static_cast<std::uint64_t>(number)),
        rig_(number % 2 == 1),
        bone_(scene_bone(run.scene)),
        replica_(bone_, BodyId{}),
        room_(bone_, static_cast<int>(std::lround(1e-3 * run.delay_ms / run.dt_s))) {
    const SimulatedDeviceParams device =
        number / 2 % 2 ? *find_simulated_device("simulated-3.3N") : SimulatedDeviceParams{};
    LoopParams params = loop_params(device.limits, {0.0, run.choice});
    params.dt_s = run.dt_s;
    // Fifty millimetres for each newton that it can hold, like sigma.7 and omega.7.
    if (run.six_axes) params.peak_nmm = kTorqueArm_mm * device.limits.continuous_n;
    const char* const tool = run.scene == StabilityScene::drill       ? "drill-3.2"
                             : run.scene == StabilityScene::thin_wall ? "burr-round-3.2"
                                                                      : "burr-round-5";
    loop_ = std::make_unique<HapticLoop>(params, std::vector<ToolModel>{ToolModel(*find_tool(tool), bone_.pitch_mm())});
    full_rpm_ = std::max(1000.0, loop_->tool(0).tool.spindle_rpm);

    const Pose start{
        {0, 0, -3},
        Eigen::Quaterniond(Eigen::AngleAxisd(run.scene == StabilityScene::drill ? 0.0 : 0.5, Vec3::UnitX()))};
    upright_ = rotation_ = start.rotation;
    WorkspaceMapping mapping;
    mapping.align(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())),
                  device.limits.stiffness_n_per_mm < 10.0 ? 0.5 : 1.0, Vec3::Zero(), start.position_mm);
    loop_->take_up(0, start, mapping);
    device_ = std::make_unique<SimulatedDevice>(device);
    HandParams hand = expert_hand();
    device_->take(scaled(hand, params.scale_of(hand.push_n), mapping.scale()),
                  mapping.pose_device_tool(start).position_mm);
    gesture_ = std::make_unique<Gesture>(run.scene, rig_, loop_->coupling_n_per_mm(), random_);
    observer_ = std::make_unique<Observer>(result, params, mapping.scale(), loop_->coupling_n_per_mm());
    if (run.six_axes) wrist_ = std::make_unique<Wrist>(random_, params.force_scale / mapping.scale());
    builder_.build(replica_.bodies(), loop_->tool(0), start, patch_);
  }

  void run(std::int64_t ticks) {
    for (std::int64_t i = 0; i < ticks; ++i) tick(static_cast<double>(i) * run_.dt_s, i);
    observer_->finish();
    result_.others_cuts += room_.others();
    result_.undone += room_.undone();
  }

 private:
  void tick(double t, std::int64_t i) {
    // Pauses of 0.3 s every 3 s: a rig stands exactly still.
    const double beat = std::fmod(t, 3.0);
    if (beat > 0.3) walked_s_ += run_.dt_s;
    const bool cuts = run_.scene == StabilityScene::burr || run_.scene == StabilityScene::drill ||
                      (run_.scene == StabilityScene::cavity && t > 0.5 * kRound_s);
    const bool pedal = cuts && std::fmod(t, 4.0) < 3.3;

    // Blends from the start pose into the gesture within half a second.
    const double in = std::min(1.0, 2.0 * t);
    if (wrist_)
      rotation_ = wrist_->step(walked_s_, in, rig_, loop_->mapping().to_bone(torque_nmm_), run_.dt_s) * upright_;
    const Vec3 target_mm =
        in * gesture_->at(walked_s_, 2.5 * (rotation_ * Vec3::UnitZ()), run_.scene == StabilityScene::cavity) +
        (1.0 - in) * Vec3(0, 0, -3);
    const WorkspaceMapping& mapping = loop_->mapping();
    HandCommand command;
    command.mode = rig_ ? HandMode::rig : HandMode::carry;
    command.target_mm = mapping.pose_device_tool({target_mm, rotation_}).position_mm;
    command.axis = mapping.to_device(Vec3::UnitZ());
    device_->command(command, mapping.pose_device_tool({Vec3::Zero(), rotation_}).rotation, pedal ? kSpindlePedal : 0u);
    device_->step(run_.dt_s);

    const DeviceReading reading = device_->read();
    LoopInput input;
    input.pose_device_tool = reading.pose_device_tool;
    input.spindle_rpm = pedal ? full_rpm_ : 0.0;
    // Sometimes the machine stops the loop for some milliseconds.
    if (std::fmod(t, kStallEvery_s) < kStall_s) input.periods = 4;
    const AllocationCounter heap;
    const LoopReport report = loop_->tick(input, patch_);
    result_.allocations += heap.count();
    device_->write(DeviceOutput(report.device.force_n));
    torque_nmm_ = report.device.torque_nmm;
    observer_->see(report, reading.pose_device_tool, pedal);
    const double below_mm = report.pose_bone_proxy.position_mm.z();
    if (run_.scene == StabilityScene::thin_wall &&
        std::hypot(report.pose_bone_proxy.position_mm.x(), report.pose_bone_proxy.position_mm.y()) < 6.0)
      result_.deepest_mm = std::max(result_.deepest_mm, below_mm);

    follow(report, i);
  }

  // Updates replica and patch, as their thread would, and lets the others cut.
  void follow(const LoopReport& report, std::int64_t i) {
    CutPiece piece;
    while (loop_->take_piece(piece)) {
      const Cut cut = cut_of(piece, loop_->tool(0), AuthorId{1}, room_.lease_epoch());
      replica_.add_own(cut);
      room_.send(cut);
    }
    const auto every = [&](double seconds) {
      return i % std::max<std::int64_t>(1, std::llround(seconds / run_.dt_s)) == 0;
    };
    // If others open a thin wall, it is no wall any more.
    if (run_.others && run_.scene != StabilityScene::thin_wall) {
      if (every(0.4)) {
        const Tool other = *find_tool("burr-round-3.2");
        const Vec3 at = report.pose_bone_proxy.position_mm + random_.in_cube(2.0);
        const Vec3 tip(at.x(), at.y(), std::clamp(at.z(), 0.2, 3.0));
        room_.commit_other(straight_cut(
            other, tip, tip + Vec3(random_.between(-1.5, 1.5), random_.between(-1.5, 1.5), 0.0), Vec3::UnitZ()));
      }
      // Also under a handle that stands still.
      if (every(1.55) && i > 0) room_.undo(1 + static_cast<int>(random_.index(30)));
    }
    room_.tick(replica_);
    if (!every(kPatch_s)) return;
    for (const ChangedLeaves& change : replica_.take_changes())
      builder_.changed(kPitch_mm, change.level, change.origins);
    builder_.build(replica_.bodies(), loop_->tool(0), report.pose_bone_proxy, patch_);
    patch_.own_cuts = replica_.last_own();
    patch_.room_seq = replica_.room_seq();
  }

  const StabilityRun& run_;
  StabilityResult& result_;
  Random random_;
  bool rig_;
  Case bone_;
  Replica replica_;
  DelayedRoom room_;
  PatchBuilder builder_;
  Patch patch_;
  std::unique_ptr<HapticLoop> loop_;
  std::unique_ptr<SimulatedDevice> device_;
  std::unique_ptr<Gesture> gesture_;
  std::unique_ptr<Observer> observer_;
  std::unique_ptr<Wrist> wrist_;  // of a turning hand
  Eigen::Quaterniond upright_, rotation_;
  Vec3 torque_nmm_ = Vec3::Zero();
  double full_rpm_ = 0, walked_s_ = 0;
};

}  // namespace

const char* name(StabilityScene scene) {
  constexpr const char* kNames[] = {"stroke", "cavity", "thin wall", "burr", "drill"};
  return kNames[static_cast<int>(scene)];
}

void StabilityResult::add(const StabilityResult& other) {
  ticks += other.ticks, late += other.late, touching += other.touching, cutting += other.cutting,
      uncovered += other.uncovered;
  held_back += other.held_back, returned += other.returned, slew_limited += other.slew_limited;
  episodes += other.episodes, others_cuts += other.others_cuts, undone += other.undone,
      allocations += other.allocations;
  generated_mj += other.generated_mj, net_mj += other.net_mj, cutting_mj += other.cutting_mj,
      turned_mj += other.turned_mj;
  worst_mj = std::max(worst_mj, other.worst_mj);
  least_cutting_n_mm = std::min(least_cutting_n_mm, other.least_cutting_n_mm);
  pushed_back += other.pushed_back, still += other.still;
  for (double StabilityResult::*most : {&StabilityResult::pushed_back_most_mj, &StabilityResult::step_over_n,
                                        &StabilityResult::still_step_n,        &StabilityResult::fall_n,
                                        &StabilityResult::motor_over_n,        &StabilityResult::motor_late_n,
                                        &StabilityResult::motor_most_n,        &StabilityResult::force_most_n,
                                        &StabilityResult::deepest_mm,          &StabilityResult::turn_step_over_n,
                                        &StabilityResult::cut_step_over_n,     &StabilityResult::cut_over_nmm,
                                        &StabilityResult::cut_late_nmm,        &StabilityResult::cut_most_nmm,
                                        &StabilityResult::torque_most_nmm,     &StabilityResult::torque_over_nmm,
                                        &StabilityResult::hand_worst_mj,       &StabilityResult::still_off_n,
                                        &StabilityResult::budget_over_n,       &StabilityResult::cue_most_n})
    this->*most = std::max(this->*most, other.*most);
}

StabilityResult run_stability(const StabilityRun& run) {
  StabilityResult result;
  const std::int64_t round = std::llround(kRound_s / run.dt_s);
  for (int number = 0; result.ticks < run.ticks; ++number) {
    StabilityResult part;
    Round(run, number, part).run(std::min(round, run.ticks - result.ticks));
    result.add(part);
  }
  return result;
}

}  // namespace osteon::test
