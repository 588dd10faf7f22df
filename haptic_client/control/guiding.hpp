// What stands on the bone, as the haptic loop feels it, and the openings of the guides among it: once a tool has
// entered an opening it stays there until it is drawn out, and goes only where the opening lets it.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/tools/guide.hpp"
#include "haptic_client/control/obstacle.hpp"

namespace osteon::haptic {

// A guide, pin, screw or implant. Made ready off the haptic thread, which only reads it.
struct PlacedGuide {
  std::uint32_t id = 0;  // of the scene's item, from 1
  Pose pose_bone_guide;
  GuideShape shape;  // without openings for what is no guide
  // What it is made of; shared by all that stand for items of one definition. Null: it is not felt.
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
  // [haptic] Where an opening lets the tool go that is wanted there; nothing while it is in none. It enters one when it
  // is wanted there and has come there itself: a hand that presses through the wall of a guide does not take it in.
  [[nodiscard]] std::optional<GuidedPose> step(std::span<const PlacedGuide> guides, const Tool& tool,
                                               const Pose& wanted_bone_tool, const Pose& pose_bone_proxy) noexcept;
  [[nodiscard]] bool held() const noexcept { return held_; }
  // Of the guide that holds the tool, while one does.
  [[nodiscard]] std::uint32_t guide_id() const noexcept { return id_; }

 private:
  bool held_ = false;
  std::uint32_t id_ = 0;
  std::size_t opening_ = 0;
};

}  // namespace osteon::haptic
