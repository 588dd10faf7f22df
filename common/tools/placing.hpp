// Ways to place an item for which the bone determines the pose: set down on the surface, turned along its thread, or
// driven home.
#pragma once
#include <optional>
#include <variant>

#include "common/core/result.hpp"
#include "common/tools/scene.hpp"

namespace osteon {

// For place_on_bone().
struct OntoBone {
  Vec3 near_mm;
  std::optional<Vec3> axis;
  Vec3 across = Vec3::UnitX();
};
// For turn_screw(): a standing screw, in (positive) or out.
struct ByThread {
  double turns = 0;
};
// For drive_home(): a standing trial implant.
struct DriveHome {
  double most_mm = 0;
};
// monostate: the pose of the item itself.
using Placing = std::variant<std::monostate, OntoBone, ByThread, DriveHome>;

// Largest distance of one motion. It bounds the time spent on queries of the bone.
inline constexpr double kFarthestMotion_mm = 100.0;

struct Placed {
  SceneItem item;               // set_by_rules() must still check it
  double contact_fraction = 0;  // driven home: share of the implant's surface in contact with bone
};
// `before`: the item as it stands, or null. If the item moves from there, only the tool of `wanted` is used. Errors:
// invalid_input, with the remedy.
[[nodiscard]] Result<Placed> placed(const Placing& how, const Standing* before, const Standing& wanted,
                                    const BoneQuery& bone);

}  // namespace osteon
