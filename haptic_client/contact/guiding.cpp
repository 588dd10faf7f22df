#include "haptic_client/contact/guiding.hpp"

#include <algorithm>

namespace osteon::haptic {

std::optional<GuidedPose> Guiding::step(std::span<const PlacedGuide> guides, const Tool& tool,
                                        const Pose& wanted_bone_tool, const Pose& pose_bone_proxy) noexcept {
  if (held_) {
    const auto guide = std::ranges::find(guides, id_, &PlacedGuide::id);
    if (guide != guides.end() && opening_ < opening_count(guide->shape))
      if (auto guided = constrain(guide->shape, opening_, guide->pose_bone_guide, tool, wanted_bone_tool))
        return guided;
    held_ = false;
  }
  for (const PlacedGuide& guide : guides) {
    const auto opening = entered(guide.shape, guide.pose_bone_guide, tool, wanted_bone_tool);
    if (!opening || entered(guide.shape, guide.pose_bone_guide, tool, pose_bone_proxy) != opening) continue;
    held_ = true;
    id_ = guide.id;
    opening_ = *opening;
    return constrain(guide.shape, opening_, guide.pose_bone_guide, tool, wanted_bone_tool);
  }
  return std::nullopt;
}

}  // namespace osteon::haptic
