#include "viewer_client/scene/item_place.hpp"

#include <array>
#include <cstdio>

#include "common/core/check.hpp"
#include "common/geometry/pose_across.hpp"

namespace osteon {

Pose pose_of(const ItemPlace& place, const std::optional<Vec3>& across_else) {
  OSTEON_CHECK(place.along.has_value());
  const auto usable = [&](const std::optional<Vec3>& across) {
    return across && across->cross(*place.along).norm() > 1e-6 * across->norm() * place.along->norm();
  };
  if (usable(place.across)) return pose_across(place.point_mm, *place.along, *place.across);
  if (usable(across_else)) return pose_across(place.point_mm, *place.along, *across_else);
  return pose_along(place.point_mm, place.along->normalized());
}

std::string standing_text(const SceneItem& item) {
  const Vec3 at = item.pose_bone_item.position_mm, along = item.pose_bone_item.direction(Vec3::UnitZ());
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), "item %u at %.2f %.2f %.2f along %.3f %.3f %.3f", item.id, at.x(), at.y(),
                at.z(), along.x(), along.y(), along.z());
  std::string words = text.data();
  if (item.turns != 0.0) {
    std::snprintf(text.data(), text.size(), ", %.2f turns in", item.turns);
    words += text.data();
  }
  if (item.seated) words += ", seated";
  return words;
}

}  // namespace osteon
