// The pose that a user requests for an item, and the item's pose in words.
#pragma once
#include <optional>
#include <string>

#include "common/tools/scene_item.hpp"

namespace osteon {

struct ItemPlace {
  Vec3 point_mm;               // bone frame
  bool on_bone = false;        // at the surface nearest to the point, not at the point
  std::optional<Vec3> along;   // its +z; may be absent only with `on_bone`: then opposite to the surface's normal
  std::optional<Vec3> across;  // its +x is as near to this as its +z allows
};
// The pose for a place that is not on the bone. `across_else` applies if the place names no `across`. An `across` along
// the axis is ignored.
[[nodiscard]] Pose pose_of(const ItemPlace& place, const std::optional<Vec3>& across_else = {});

// "item 3 at 1.00 2.00 3.00 along 0.000 0.000 -1.000, 4.50 turns in, seated". The script's commands accept these
// numbers.
[[nodiscard]] std::string standing_text(const SceneItem& item);

}  // namespace osteon
