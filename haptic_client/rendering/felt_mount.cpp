#include "haptic_client/rendering/felt_mount.hpp"

#include <algorithm>

namespace osteon::haptic {
namespace {

// Time between two loads sent, and between two messages of a hand that does not push.
constexpr double kPush_s = 8e-3, kIdle_s = 96e-3;

}  // namespace

Load load_on_bone(const HapticLoop& loop, const LoopReport& report, const Pose& pose_rest_bone,
                  const Vec3& centre_now_mm) noexcept {
  const double s = loop.params().force_scale;
  const WorkspaceMapping& mapping = loop.mapping();
  const Vec3 force_n = -loop.params().compression.inverse(Vec3(mapping.to_bone(report.coupling.device_n) / s));
  Load load = Load::at(force_n, pose_rest_bone.point(report.pose_bone_proxy.position_mm) - centre_now_mm);
  load.moment_nmm += mapping.to_bone(report.coupling.device_nmm) * (mapping.scale() / -s);
  return load;
}

void FeltMount::see(std::uint64_t line, const MountPose& seen) noexcept {
  if (line != line_ && there()) shown_.rejoin();
  line_ = line;
  shown_.see(seen);
}

void FeltMount::step(HapticLoop& loop, const LoopReport& last) noexcept {
  if (!there()) return;
  const double dt_s = loop.params().dt_s;
  load_ = load_on_bone(loop, last, pose_, mount_.centre_mm + shown_.shift().place_mm);
  shown_.step(load_, dt_s);
  pose_ = shown_.pose_world_bone();
  loop.see_bone(pose_);
  const Shift shift = shown_.shift();
  most_mm_ = std::max(most_mm_, shift.place_mm.norm());
  most_rad_ = std::max(most_rad_, shift.turn_rad.norm());
  // The end of a push is sent as promptly as a push.
  const bool pushes = !load_.force_n.isZero() || !load_.moment_nmm.isZero();
  until_push_s_ = std::min(until_push_s_ - dt_s, pushes == pushed_ ? kIdle_s : kPush_s);
}

std::optional<MountLoad> FeltMount::push() noexcept {
  if (!there() || until_push_s_ > 0.0) return {};
  pushed_ = !load_.force_n.isZero() || !load_.moment_nmm.isZero();
  until_push_s_ = pushed_ ? kPush_s : kIdle_s;
  return shown_.push();
}

}  // namespace osteon::haptic
