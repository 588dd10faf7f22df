// The compliant mount of a room's bone. Receives loads on any thread and advances the motion on the tick thread. It
// lasts as long as the room is open. It is neither an event of the room nor part of its bone.
#pragma once
#include <chrono>

#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/mechanics/compliant_mount.hpp"

namespace osteon {

class BoneMount {
 public:
  explicit BoneMount(const MountServerParams& params) : bone_(params) {}

  // For every session that opens, also if its author had one before.
  void join(AuthorId author);
  void leave(AuthorId author);
  // Ignored if the author has not joined, or if the load is not newer than the last one.
  void push(AuthorId author, const MountLoad& push);

  // [tick] `now`: time since any start; never decreases. Returns true when the pose is to be sent to everybody who
  // joined: at every tick while the bone moves, and also now and then at rest. A pose can be lost, and these messages
  // let a client know that there is a mount.
  [[nodiscard]] bool step(std::chrono::nanoseconds now);
  // [tick] The pose as sent to this author.
  [[nodiscard]] MountPose seen(AuthorId author);

 private:
  Mutex mutex_{LockRank::leaf};
  MountServer bone_ OSTEON_GUARDED_BY(mutex_);
  std::chrono::nanoseconds stepped_ OSTEON_GUARDED_BY(mutex_){-1}, sent_ OSTEON_GUARDED_BY(mutex_){};
};

}  // namespace osteon
