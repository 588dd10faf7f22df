// The bone on its compliant mount as the user of one haptic client feels it. It takes the poses received from the room.
// It moves the bone by the loop's last force, and makes the loads to be sent. Without a mount in the room nothing is
// received, and the bone rests.
#pragma once
#include <cstdint>
#include <optional>

#include "common/mechanics/compliant_mount.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"

namespace osteon::haptic {

// The load of the tool in hand on the bone in that tick, about the mount's centre; axes of the bone at rest. It is the
// coupling's force, which the loop's ledger accounts for, unscaled. The motor's force bypasses that account, and
// therefore the mount too.
[[nodiscard]] Load load_on_bone(const HapticLoop& loop, const LoopReport& report, const Pose& pose_rest_bone,
                                const Vec3& centre_now_mm) noexcept;

// All [haptic] except the constructor; nothing allocates.
class FeltMount {
 public:
  explicit FeltMount(const MountParams& mount) : mount_(mount), shown_({.mount = mount}) {}

  // A pose received from the room. `line` rises with every session, because pose numbers restart with it.
  void see(std::uint64_t line, const MountPose& seen) noexcept;
  // Before each tick: moves the bone by the received poses and by the last tick's load, and passes its pose to the
  // loop.
  void step(HapticLoop& loop, const LoopReport& last) noexcept;
  // The load to be sent now, about 120 times a second while there is one.
  [[nodiscard]] std::optional<MountLoad> push() noexcept;

  [[nodiscard]] bool there() const noexcept { return line_ > 0; }  // the room has a mount
  [[nodiscard]] const MountFollower& shown() const noexcept { return shown_; }
  [[nodiscard]] const Load& load() const noexcept { return load_; }
  [[nodiscard]] const Pose& pose_rest_bone() const noexcept { return pose_; }
  // Largest distance of the bone's middle from its rest position so far, mm.
  [[nodiscard]] double most_mm() const noexcept { return most_mm_; }
  [[nodiscard]] double most_rad() const noexcept { return most_rad_; }

 private:
  MountParams mount_;
  MountFollower shown_;
  Pose pose_;
  Load load_;
  std::uint64_t line_ = 0;
  double most_mm_ = 0, most_rad_ = 0;
  double until_push_s_ = 0;
  bool pushed_ = false;  // the last load sent was not zero
};

}  // namespace osteon::haptic
