// What stands on or in the bone: guides, pins, screws and trial implants. Each item stores the sequence number of the
// event that last set it.
#pragma once
#include <cstdint>
#include <vector>

#include "common/core/id.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

struct SceneItem {
  std::uint32_t id = 0;  // given by the room, from 1
  BodyId body;           // the bone that it stands on
  Digest tool;           // the hash of its definition
  Pose pose_bone_item;
  double turns = 0;          // screw: turns that it was driven in
  bool seated = false;       // guide: fixed by two pins or more; screw: head on the bone; implant: driven home
  std::uint64_t set_at = 0;  // room_seq
  friend bool operator==(const SceneItem& a, const SceneItem& b);
};

}  // namespace osteon
