// A tool made ready for the haptic loop: its contact points, how it is fed, and the law by which it cuts.
#pragma once
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/tools/tool_solid.hpp"
#include "haptic_client/control/contact.hpp"
#include "haptic_client/control/cut_shape.hpp"

namespace osteon::haptic {

// Where the hand may feed a tool so that it cuts.
enum class Feeding : std::uint8_t {
  none,      // it does not cut
  along,     // along its axis, into the hole that it makes: drills, reamers, pins, screws, broaches
  in_plane,  // in the plane of its blade: saws
  any,       // wherever it is pushed: burs, solids of any form
};
[[nodiscard]] Feeding feeding(ToolKind kind) noexcept;
[[nodiscard]] bool feeds_along_axis(ToolKind kind) noexcept;

// The haptic loop has room for so many points, those that fill up groups included.
inline constexpr int kMostContactPoints = 8192;

struct ToolModel {
  Tool tool;
  Implicit solid;  // cutting part and shank, of a saw over its whole stroke; made once
  Feeding feed = Feeding::along;
  bool axial = false;                 // feed is along
  CutShape outline;                   // what it takes away
  int cut_level = 0;                  // the level of its cuts: the tool's own or the finest of the case
  double fine_pitch_mm = 0;           // of that level
  double inset = 0;                   // mm, see ContactPoint
  double least_facing = 0.2;          // faces that look less than this into the feed neither cut nor resist
  std::vector<ContactPoint> active;   // on the part that cuts
  std::vector<ContactPoint> passive;  // walls and shank: they only block
  ContactSet contact;                 // both, in the same order
  DensityTable strength;              // milling_resistance() of 1 mm2 at 1 mm from the axis
  double active_area_mm2 = 0;
  double wear = 1.0;
  const ForceLaw* law = nullptr;  // never null
  LawTool law_tool;
  SpindleParams spindle;
  Vec3 stroke = Vec3::Zero();  // of a saw: along which its teeth go to and fro, tool frame; zero: it turns or stands

  // `pitch_mm`: h of the case. The law is the tool's own, its kind's where it names none; whoever loads a tool has seen
  // that it fits (choose_law), else this aborts. `points`: on the part that cuts, at least; 0: as many as its size asks
  // for.
  ToolModel(const Tool& tool, double pitch_mm, double wear = 1.0, int points = 0);
  // The same with the law of this name, if it is not empty, instead of the tool's own. Error invalid_input:
  // choose_law's.
  [[nodiscard]] static Result<ToolModel> make(const Tool& tool, double pitch_mm, double wear,
                                              std::string_view law_name);

 private:
  ToolModel(const Tool& tool, double pitch_mm, double wear, int points, const ForceLaw& law);
};

}  // namespace osteon::haptic
