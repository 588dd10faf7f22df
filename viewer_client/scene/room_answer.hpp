// The room's answer to what a viewer asks of it.
#pragma once
#include <optional>
#include <string>

#include "common/core/id.hpp"

namespace osteon {

struct RoomAnswer {
  RoomSeq place;              // of the event that follows; contained in the file where the bone was saved
  std::optional<int> events;  // that an undo or redo reached: fewer than asked where there are no more
  std::string said = {};      // where an item that was set stands now
};

}  // namespace osteon
