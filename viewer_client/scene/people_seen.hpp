// All that a window shows of the people of a room, as received from the room.
#pragma once
#include <vector>

#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

struct PeopleSeen {
  std::vector<PersonSeen> people{};
  std::vector<Annotation> annotations{};
  std::vector<WordsSeen> words{};  // the newest texts, oldest first
};

}  // namespace osteon
