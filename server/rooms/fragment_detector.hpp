// Finds fragments beside the room. Keeps a copy of every body. So the room is locked only while a few leaves are
// copied, and never while fragments are searched or made.
#pragma once
#include <functional>
#include <map>
#include <vector>

#include "common/core/mutex.hpp"
#include "server/room/room.hpp"

namespace osteon {

// One thread. The copies lack only what Room::take_changes() has not yet returned.
class FragmentDetector {
 public:
  // Fills the values of leaves in batches, under the room's lock. Removes the leaves of bodies that no longer exist.
  using ReadLeaves = std::function<void(std::vector<FieldLeaf>& leaves)>;
  FragmentDetector(Room& room, SharedMutex& room_mutex, ReadLeaves read)
      : room_(room), mutex_(room_mutex), read_(std::move(read)) {}

  // Brings the copies up to date and returns the fragments that have come apart. The room must decide about all of them
  // before the next call.
  [[nodiscard]] std::vector<Separation> look();
  // Bone came back in the meantime: the body is searched again from the beginning.
  void lose(BodyId body) { bodies_.erase(body); }

 private:
  struct Watched {
    CutField copy;
    FragmentFinder finder;
  };
  void begin(BodyId body);
  [[nodiscard]] Separation separation(BodyId body, const Watched& watched, std::vector<Fragment> fragments,
                                      std::uint32_t& next_body) const;

  Room& room_;
  SharedMutex& mutex_;
  ReadLeaves read_;
  std::map<BodyId, Watched> bodies_;
};

}  // namespace osteon
