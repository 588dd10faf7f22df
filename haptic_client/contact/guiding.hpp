// The items on the bone, as the haptic loop feels them, and the openings of the guides among them. A tool that has
// entered an opening stays in it until it is drawn out, and goes only where the opening permits.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/tools/guide.hpp"
#include "haptic_client/contact/obstacle.hpp"

namespace osteon::haptic {

// A guide, pin, screw or implant. Prepared off the haptic thread, which only reads it.
struct PlacedGuide {
  std::uint32_t id = 0;  // number of the item in the scene, from 1
  Pose pose_bone_guide;
  GuideShape shape;  // without openings if the item is no guide
  // The item's solid, shared by all items of one definition. Null: it is not felt.
  std::shared_ptr<const SolidLattice> solid;
};
[[nodiscard]] inline PlacedGuide placed_guide(std::uint32_t id, const Tool& guide, const Pose& pose_bone_guide,
                                              std::shared_ptr<const SolidLattice> solid = nullptr) {
  if (!solid) solid = std::make_shared<const SolidLattice>(guide);
  return {id, pose_bone_guide, guide_shape(guide), std::move(solid)};
}

class Guiding {
 public:
  // [haptic] Another tool is taken up.
  void release() noexcept { held_ = false; }
  // [haptic] The pose that an opening permits for the wanted one; nothing while the tool is in no opening. The tool
  // enters an opening when both the wanted pose and the tool itself are there. A hand that presses through the wall of
  // a guide does not enter.
  [[nodiscard]] std::optional<GuidedPose> step(std::span<const PlacedGuide> guides, const Tool& tool,
                                               const Pose& wanted_bone_tool, const Pose& pose_bone_proxy) noexcept;
  [[nodiscard]] bool held() const noexcept { return held_; }
  // Number of the guide that holds the tool, while one does.
  [[nodiscard]] std::uint32_t guide_id() const noexcept { return id_; }

 private:
  bool held_ = false;
  std::uint32_t id_ = 0;
  std::size_t opening_ = 0;
};

}  // namespace osteon::haptic
