// Each tool's solid as implicit functions, combined by union, intersection and difference (Niu 2008, §6.1).
#pragma once
#include "common/tools/implicit.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// The cutting part at rest: bur, flutes, toothed end of a blade. For a tool that does not cut, the whole body.
[[nodiscard]] Implicit cutting_part(const Tool& tool);
// Cutting part and shank: everything that can be touched. Equal to signed_distance_mm(), but made once for many points.
[[nodiscard]] Implicit tool_solid(const Tool& tool);
// The solid that a cut removes at one pose: a drill's lips with the land behind them (deploy/decisions/0005), or the
// envelope of a saw's stroke. Tool::cut_body() holds it in whole numbers. Only for tools that cut.
[[nodiscard]] Implicit cut_solid(const Tool& tool);

// The same as outlines, mm. Empty if the cutting body is of another kind.
struct CutOutline {
  CutKind kind = CutKind::none;
  double radius_mm = 0;           // ball
  std::vector<Corner> profile;    // turned
  double dome_mm = 0;             // turned: radius of the ball that clips it; 0 for none
  std::vector<HalfSpace> planes;  // hull
};
[[nodiscard]] CutOutline cut_outline(const Tool& tool);

// Height of a conical point: of a drill, a pin or a screw's core.
[[nodiscard]] double point_height_mm(const Tool& tool);
// Where the shank begins: behind the cutting part, or inside the ball of a round bur, where the ball is as thin as the
// shank.
[[nodiscard]] double shank_start_mm(const Tool& tool);
// Radius of a contoured bur's rounded end, such that the taper reaches the bur's diameter at its cutting length.
[[nodiscard]] double end_radius_mm(const Tool& contoured_burr);
// How far the ends of an oscillating saw's tooth line are behind its middle, at the ends of the stroke.
[[nodiscard]] double tooth_line_drop_mm(const Tool& oscillating_saw);

}  // namespace osteon
