// The room's answer to a viewer's request.
#pragma once
#include <optional>
#include <string>

#include "common/core/id.hpp"

namespace osteon {

struct RoomAnswer {
  RoomSeq place;              // of the event that follows; for a saved bone, the newest event in the file
  std::optional<int> events;  // undone or redone; fewer than asked for if there are no more
  std::string said = {};      // where a placed item stands now
};

}  // namespace osteon
