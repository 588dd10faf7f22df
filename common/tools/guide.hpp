// What a guide does to a tool that goes through it: a drill's axis stays within the sleeve's play, a saw blade within its
// slot (§6.2 of the dissertation, figures 6.4 and 9.9).
#pragma once
#include <optional>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

// A straight hole through a guide, guide frame.
struct GuideBore {
  Vec3 entry_mm;      // middle of the end where the tool comes in
  Vec3 direction;     // unit, the way in
  double diameter_mm;
  double length_mm;
};
// A flat slot through a guide, guide frame.
struct GuideSlot {
  Vec3 entry_mm;      // middle of the mouth
  Vec3 direction;     // unit, the way in
  Vec3 normal;        // unit, across the flat; perpendicular to `direction`
  double height_mm;   // along `normal`
  double width_mm;    // across both
  double depth_mm;    // along `direction`
};

struct GuideShape {
  std::vector<GuideBore> bores;      // for drills
  std::vector<GuideBore> pin_holes;  // for pins that fix the guide
  std::vector<GuideSlot> slots;      // for saws
};
// Of a tool that is a guide; empty for any other. The guide's frame is a tool's: its face towards the bone at z = 0, its
// body before it at z < 0, so that tools go through along +z. Blocks: width along x, thickness along y; the flat of a
// slot lies along x, pin holes (of diameter_mm) in both ends of x. A 4-in-1 block's slots come in the order anterior
// (y > 0), posterior, anterior chamfer, posterior chamfer; its thickness should exceed 3.5 times its cutting_length_mm,
// else the chamfers' slots cross.
[[nodiscard]] GuideShape guide_shape(const Tool& guide);

struct GuidedPose {
  Pose pose_bone_tool;
  double play_mm = 0;      // how far the tip may be off the middle at the guide's exit (radius, or half the height)
  double correction_mm = 0;// how far the tip was moved
};

// The pose next to the wanted one that the guide allows, or nothing while the tool is outside every opening that fits it.
// A bore leaves turning about and moving along its axis free, and the play c = (bore − tool) / 2 across; a slot leaves
// its plane free, and the play across. Pure; any thread.
[[nodiscard]] std::optional<GuidedPose> constrain(const Tool& guide, const GuideShape& shape, const Pose& pose_bone_guide,
                                                  const Tool& tool, const Pose& wanted_bone_tool);

}  // namespace osteon
