// Finds the pieces that come apart, beside the room: it keeps a copy of every body, so that the room is held still only
// while a few leaves are copied, and never while pieces are looked for or made.
#pragma once
#include <functional>
#include <map>
#include <shared_mutex>
#include <vector>

#include "server/room/room.hpp"

namespace osteon {

// One thread. The copies lack nothing but what Room::take_changes() has yet to tell.
class FragmentDetector {
 public:
  // Fills the values of leaves, a batch at a time under the room's lock; leaves out those of bodies that are gone.
  using ReadLeaves = std::function<void(std::vector<FieldLeaf>& leaves)>;
  FragmentDetector(Room& room, std::shared_mutex& room_mutex, ReadLeaves read)
      : room_(room), mutex_(room_mutex), read_(std::move(read)) {}

  // Follows the bodies to where they are now, and says what has come apart. The room decides about all of it before the
  // next call.
  [[nodiscard]] std::vector<Separation> look();
  // Bone came back meanwhile: the body is looked at from the beginning.
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
  std::shared_mutex& mutex_;
  ReadLeaves read_;
  std::map<BodyId, Watched> bodies_;
};

}  // namespace osteon
