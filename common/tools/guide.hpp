// What a guide does to a tool that goes through it: a drill's axis stays within the sleeve's play, a saw blade within
// its slot (Niu 2008, §6.2, figures 6.4 and 9.9).
#pragma once
#include <optional>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

// A straight hole through a guide, guide frame.
struct GuideBore {
  Vec3 entry_mm;   // middle of the end where the tool comes in
  Vec3 direction;  // unit, the way in
  double diameter_mm;
  double length_mm;
};
// A flat slot through a guide, guide frame.
struct GuideSlot {
  Vec3 entry_mm;     // middle of the mouth
  Vec3 direction;    // unit, the way in
  Vec3 normal;       // unit, across the flat; perpendicular to `direction`
  double height_mm;  // along `normal`
  double width_mm;   // across both
  double depth_mm;   // along `direction`
};

struct GuideShape {
  std::vector<GuideBore> bores;      // for drills
  std::vector<GuideBore> pin_holes;  // for pins that fix the guide
  std::vector<GuideSlot> slots;      // for saws
};
// Of a tool that is a guide; empty for any other. The guide's frame is a tool's: its face towards the bone at z = 0,
// its body before it at z < 0, so that tools go through along +z. Blocks: width along x, thickness along y; the flat of
// a slot lies along x, pin holes (of diameter_mm) in both ends of x. A 4-in-1 block's slots come in the order anterior
// (y > 0), posterior, anterior chamfer, posterior chamfer; its thickness should exceed 3.5 times its cutting_length_mm,
// else the chamfers' slots cross.
[[nodiscard]] GuideShape guide_shape(const Tool& guide);

// The openings of a shape in one list: bores, then pin holes, then slots. A tool that is in one stays in it until it is
// drawn out, however hard it is pulled sideways: so whoever moves the tool remembers the opening.
[[nodiscard]] std::size_t opening_count(const GuideShape& shape) noexcept;
// Whether this tool goes into this opening at all: what turns on its axis into bores and holes, blades into slots.
[[nodiscard]] bool fits(const GuideShape& shape, std::size_t opening, const Tool& tool) noexcept;
// The opening that the tool is in, or whose lead-in its tip has come to; its pose is one that the opening allows.
[[nodiscard]] std::optional<std::size_t> entered(const GuideShape& shape, const Pose& pose_bone_guide, const Tool& tool,
                                                 const Pose& pose_bone_tool) noexcept;

struct GuidedPose {
  Pose pose_bone_tool;
  double depth_mm = 0;       // of the tip below the opening's mouth, along its direction; negative before it
  double play_mm = 0;        // how far the tip may be off the middle at that depth
  double correction_mm = 0;  // how far the tip was moved
};

// The pose next to the wanted one that the opening allows; nothing once the tip is drawn back beyond the lead-in. A
// bore leaves turning about the axis and moving along it free, and across it the play c = (bore − tool) / 2 from its
// mouth to its end or the tip: beyond a bore of length L the tip stays within c (1 + 2 l / L) of the middle, l from the
// end. A slot holds the blade's plate in the same way across its flat, and by its width along it. Next means: smallest
// change of the axis in the middle of the opening, and of its slope times four times the opening's length, squared and
// added; the tip's depth stays. Continuous in the wanted pose; an allowed pose comes back as it is. Pure, no
// allocation.
[[nodiscard]] std::optional<GuidedPose> constrain(const GuideShape& shape, std::size_t opening,
                                                  const Pose& pose_bone_guide, const Tool& tool,
                                                  const Pose& wanted_bone_tool) noexcept;

}  // namespace osteon
