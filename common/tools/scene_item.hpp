// What is left standing on or in the bone: guides, pins, screws and trial implants. Registers of the room: each has the
// place in the room's order that last set it.
#pragma once
#include <cstdint>
#include <vector>

#include "common/core/id.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

struct SceneItem {
  std::uint32_t id = 0;  // given by the room, from 1
  BodyId body;           // the bone it stands on
  Digest tool;           // its definition
  Pose pose_bone_item;
  double turns = 0;          // screw: how far it was turned in
  bool seated = false;       // guide: fixed by two pins or more; screw: head on the bone; implant: driven home
  std::uint64_t set_at = 0;  // room_seq
  friend bool operator==(const SceneItem& a, const SceneItem& b);
};

}  // namespace osteon
