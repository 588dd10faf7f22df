// A tool made ready for the haptic loop: its contact points and the law by which it cuts.
#pragma once
#include <vector>

#include "common/mechanics/drilling.hpp"
#include "common/mechanics/milling.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/tools/tool.hpp"

namespace osteon::haptic {

struct ContactPoint {
  Vec3 surface_mm;   // on the tool, tool frame
  Vec3 inset_mm;     // moved inwards by half a patch pitch and the pose quantum, else a tool jams in its own hole
  Vec3 outward;      // unit normal out of the tool
  double area_mm2;
  double axis_distance_mm;
};

struct ToolModel {
  Tool tool;
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
