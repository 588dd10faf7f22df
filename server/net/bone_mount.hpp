// The bone of a room on its mount, for whoever pushes it: what lines bring on any thread, what time does on the tick's.
// It lasts as long as the room is open; it is no event of the room and no part of its bone.
#pragma once
#include <chrono>
#include <mutex>

#include "common/core/id.hpp"
#include "common/mechanics/compliant_mount.hpp"

namespace osteon {

class BoneMount {
 public:
  explicit BoneMount(const MountServerParams& params) : bone_(params) {}

  // Of every session that is opened, also where its author had another.
  void join(AuthorId author);
  void leave(AuthorId author);
  // Of nobody who joined, or no newer than what came: it is ignored.
  void push(AuthorId author, const MountLoad& push);

  // [tick] `now`: since any start, never falls. True: everybody who joined is to be told: at every tick while the bone
  // is not at rest, and now and then in any case, as a place may be lost and a client knows by them that there is a
  // mount.
  [[nodiscard]] bool step(std::chrono::nanoseconds now);
  // [tick] What this author is told.
  [[nodiscard]] MountPose seen(AuthorId author);

 private:
  std::mutex mutex_;  // never held with another that is taken within
  MountServer bone_;
  std::chrono::nanoseconds stepped_{-1}, told_{};
};

}  // namespace osteon
