// Ways for an item to come to stand that the bone decides: set down on its surface, turned along its thread, driven
// home.
#pragma once
#include <optional>
#include <variant>

#include "common/core/result.hpp"
#include "common/tools/scene.hpp"

namespace osteon {

// By place_on_bone().
struct OntoBone {
  Vec3 near_mm;
  std::optional<Vec3> axis;
  Vec3 across = Vec3::UnitX();
};
// By turn_screw(): a screw that stands, in (positive) or out.
struct ByThread {
  double turns = 0;
};
// By drive_home(): a trial implant that stands.
struct DriveHome {
  double most_mm = 0;
};
// Nothing: where the item itself says.
using Placing = std::variant<std::monostate, OntoBone, ByThread, DriveHome>;

// The farthest that one motion goes: it bounds how long the bone is asked.
inline constexpr double kFarthestMotion_mm = 100.0;

struct Placed {
  SceneItem item;               // yet to be judged by set_by_rules()
  double contact_fraction = 0;  // driven home: share of the implant's surface that lies on bone
};
// `before`: the item as it stands, or null; where it moves from there, `wanted` gives no more than its tool. Errors:
// invalid_input, with the remedy.
[[nodiscard]] Result<Placed> placed(const Placing& how, const Standing* before, const Standing& wanted,
                                    const BoneQuery& bone);

}  // namespace osteon
