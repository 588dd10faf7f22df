// Everything that a window shows of the people of a room, as far as the room has told.
#pragma once
#include <vector>

#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

struct PeopleSeen {
  std::vector<PersonSeen> people{};
  std::vector<Annotation> annotations{};
  std::vector<WordsSeen> words{};  // said lately, oldest first
};

}  // namespace osteon
