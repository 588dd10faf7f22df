// The bone on its mount as one hand feels it: what the room tells comes in, the loop's last force moves it, what is to
// be told goes out. Of a room without a mount nothing comes, and the bone rests.
#pragma once
#include <cstdint>
#include <optional>

#include "common/mechanics/compliant_mount.hpp"
#include "haptic_client/control/haptic_loop.hpp"

namespace osteon::haptic {

// What the tool in hand did to the bone in that tick, about the mount's centre; axes of the bone's rest. It is the
// force that the loop's ledger accounts for, unscaled: the coupling's. The motor's passes the account by, and so the
// mount.
[[nodiscard]] Load load_on_bone(const HapticLoop& loop, const LoopReport& report, const Pose& pose_rest_bone,
                                const Vec3& centre_now_mm) noexcept;

// All [haptic] but the constructor; nothing allocates.
class FeltMount {
 public:
  explicit FeltMount(const MountParams& mount) : mount_(mount), shown_({.mount = mount}) {}

  // A place that the room has told. `line`: rises with every session, as numbers of places begin anew with it.
  void see(std::uint64_t line, const MountPose& seen) noexcept;
  // Before each tick: moves the bone by what it was told, and by what the last tick did to it, and tells the loop.
  void step(HapticLoop& loop, const LoopReport& last) noexcept;
  // The push that is to be told now, about 120 times a second while there is one.
  [[nodiscard]] std::optional<MountLoad> push() noexcept;

  [[nodiscard]] bool there() const noexcept { return line_ > 0; }  // the room has a mount
  [[nodiscard]] const MountFollower& shown() const noexcept { return shown_; }
  [[nodiscard]] const Load& load() const noexcept { return load_; }
  [[nodiscard]] const Pose& pose_rest_bone() const noexcept { return pose_; }
  [[nodiscard]] double most_mm() const noexcept {
    return most_mm_;
  }  // that its middle was ever away from where it rests
  [[nodiscard]] double most_rad() const noexcept { return most_rad_; }

 private:
  MountParams mount_;
  MountFollower shown_;
  Pose pose_;
  Load load_;
  std::uint64_t line_ = 0;
  double most_mm_ = 0, most_rad_ = 0;
  double until_push_s_ = 0;
  bool pushed_ = false;  // as was told last
};

}  // namespace osteon::haptic
