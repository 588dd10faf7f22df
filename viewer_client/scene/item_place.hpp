// Where a user wants an item to stand, and where it does, in words.
#pragma once
#include <optional>
#include <string>

#include "common/tools/scene_item.hpp"

namespace osteon {

struct ItemPlace {
  Vec3 point_mm;               // bone frame
  bool on_bone = false;        // at the surface nearest to the point, not at the point
  std::optional<Vec3> along;   // its +z; without one, which only `on_bone` may be, against the surface's normal
  std::optional<Vec3> across;  // its +x as near to this as its +z allows
};
// The pose of a place that is not on the bone. `across_else`: where it names none; one along the axis counts for
// nothing.
[[nodiscard]] Pose pose_of(const ItemPlace& place, const std::optional<Vec3>& across_else = {});

// "item 3 at 1.00 2.00 3.00 along 0.000 0.000 -1.000, 4.50 turns in, seated": numbers as the script's commands take
// them.
[[nodiscard]] std::string standing_text(const SceneItem& item);

}  // namespace osteon
