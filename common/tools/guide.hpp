// How a guide constrains a tool that goes through it. A drill's axis stays within the sleeve's play, a saw blade within
// its slot (Niu 2008, §6.2, figures 6.4 and 9.9).
#pragma once
#include <optional>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

// A straight hole through a guide, guide frame.
struct GuideBore {
  Vec3 entry_mm;   // middle of the end where the tool enters
  Vec3 direction;  // unit, direction of insertion
  double diameter_mm;
  double length_mm;
};
// A flat slot through a guide, guide frame.
struct GuideSlot {
  Vec3 entry_mm;     // middle of the mouth
  Vec3 direction;    // unit, direction of insertion
  Vec3 normal;       // unit, across the flat; perpendicular to `direction`
  double height_mm;  // along `normal`
  double width_mm;   // perpendicular to `normal` and `direction`
  double depth_mm;   // along `direction`
};

struct GuideShape {
  std::vector<GuideBore> bores;      // for drills
  std::vector<GuideBore> pin_holes;  // for pins that fix the guide
  std::vector<GuideSlot> slots;      // for saws
};
// Shape of a tool that is a guide; empty for any other tool. The guide's frame is that of a tool: the face towards the
// bone is at z = 0 and the body at z < 0. So tools go through along +z. Blocks: width along x, thickness along y. The
// flat of a slot lies along x, and pin holes (of diameter_mm) are at both ends of x. The slots of a 4-in-1 block are in
// the order anterior (y > 0), posterior, anterior chamfer, posterior chamfer. Its thickness should exceed 3.5 times its
// cutting_length_mm, otherwise the slots of the chamfers cross.
[[nodiscard]] GuideShape guide_shape(const Tool& guide);

// The openings of a shape in one list: bores, then pin holes, then slots. A tool in an opening stays in it until it is
// drawn out, however hard it is pulled sideways. So whoever moves the tool must remember the opening.
[[nodiscard]] std::size_t opening_count(const GuideShape& shape) noexcept;
// Whether this tool goes into this opening at all: turning tools into bores and holes, blades into slots.
[[nodiscard]] bool fits(const GuideShape& shape, std::size_t opening, const Tool& tool) noexcept;
// The opening that the tool is in, or whose lead-in its tip has reached. The opening allows the tool's pose.
[[nodiscard]] std::optional<std::size_t> entered(const GuideShape& shape, const Pose& pose_bone_guide, const Tool& tool,
                                                 const Pose& pose_bone_tool) noexcept;

struct GuidedPose {
  Pose pose_bone_tool;
  double depth_mm = 0;       // of the tip below the opening's mouth, along its direction; negative before it
  double play_mm = 0;        // largest distance of the tip from the middle at that depth
  double correction_mm = 0;  // distance by which the tip was moved
};

// The allowed pose nearest to the wanted one. Nothing once the tip is drawn back beyond the lead-in. A bore leaves
// rotation about the axis and motion along it free. Across it, the play is c = (bore − tool) / 2 from its mouth to
// its end or the tip. Beyond a bore of length L the tip stays within c (1 + 2 l / L) of the middle, l from the end. A
// slot constrains the blade's plate in the same way across its flat, and by its width along it. Nearest means: the
// smallest sum of squares of the change of the axis in the middle of the opening, and of the change of its slope times
// four times the opening's length. The tip's depth stays. The result is continuous in the wanted pose, and an allowed
// pose is returned unchanged. Pure, no allocation.
[[nodiscard]] std::optional<GuidedPose> constrain(const GuideShape& shape, std::size_t opening,
                                                  const Pose& pose_bone_guide, const Tool& tool,
                                                  const Pose& wanted_bone_tool) noexcept;

}  // namespace osteon
