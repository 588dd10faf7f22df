#include "common/tools/scene_item.hpp"

namespace osteon {

bool operator==(const SceneItem& a, const SceneItem& b) {
  return a.id == b.id && a.body == b.body && a.tool == b.tool &&
         a.pose_bone_item.position_mm == b.pose_bone_item.position_mm &&
         a.pose_bone_item.rotation.coeffs() == b.pose_bone_item.rotation.coeffs() && a.turns == b.turns &&
         a.seated == b.seated && a.set_at == b.set_at;
}

}  // namespace osteon
