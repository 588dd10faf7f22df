// Pictures of the islands of bone in a scan, those that are left out included.
#pragma once
#include <span>
#include <vector>

#include "common/imaging/islands.hpp"
#include "server/import/picture.hpp"

namespace osteon::import {

inline constexpr std::size_t kMostIslandsDrawn = 24;  // pictures of single islands

struct IslandViews {
  Picture overview;           // all of them from the front and from the left; those left out are grey
  std::vector<Picture> each;  // of the first islands of the list, from the front
};

// Error: cancelled.
[[nodiscard]] Result<IslandViews> draw_islands(const imaging::HuVolume& volume, const imaging::Islands& islands,
                                               std::span<const int> kept, const KeepGoing& keep_going);

}  // namespace osteon::import
