// A tool made ready for the haptic loop: its contact points and the law by which it cuts.
#pragma once
#include <array>
#include <vector>

#include "common/mechanics/drilling.hpp"
#include "common/mechanics/milling.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon::haptic {

struct ContactPoint {
  Vec3 surface_mm;   // on the tool, tool frame
  Vec3 inset_mm;     // moved inwards by half a patch pitch and the pose quantum, else a tool jams in its own hole
  Vec3 outward;      // unit normal out of the tool
  double area_mm2;
  double axis_distance_mm;
};

// What a body of revolution leaves free behind it when it goes along its axis: the half-planes of its outline that do not
// look back, in (distance from the axis, place along it), and a ball that rounds its end.
struct SweptOutline {
  struct Plane {
    double r = 0, z = 0, offset_mm = 0;
  };
  std::array<Plane, kMostProfileCorners + 3> planes;
  int count = 0;
  double dome_mm = 0;
  // Of a point in the tool's frame: exact inside and before faces, too small before edges, where only the sign counts.
  [[nodiscard]] double distance_mm(const Vec3& point_mm) const noexcept;
};

// Whether the hand feeds it along its axis into the hole that it makes; the others cut sideways too, or not at all.
[[nodiscard]] bool feeds_along_axis(ToolKind kind) noexcept;

struct ToolModel {
  Tool tool;
  Implicit solid;                       // cutting part and shank, made once
  bool axial = false;                   // feeds_along_axis
  SweptOutline outline;                 // axial
  int cut_level = 0;                    // the level of its cuts: the tool's own or the finest of the case
  double fine_pitch_mm = 0;             // of that level
  double inset = 0;                     // mm, see ContactPoint
  std::vector<ContactPoint> active;     // on the part that cuts
  std::vector<ContactPoint> passive;    // walls and shank: they only block
  DrillingParams drilling;
  MillingParams milling;
  SpindleParams spindle;

  // `pitch_mm`: h of the case.
  ToolModel(const Tool& tool, double pitch_mm, double wear = 1.0);
};

}  // namespace osteon::haptic
