// A tool prepared for the haptic loop: its contact points, how it is fed, and the law by which it cuts.
#pragma once
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/tools/tool_solid.hpp"
#include "haptic_client/contact/contact.hpp"
#include "haptic_client/contact/cut_shape.hpp"

namespace osteon::haptic {

// In which directions a tool cuts when it is fed.
enum class Feeding : std::uint8_t {
  none,      // it does not cut
  along,     // along its axis, into the hole that it makes: drills, reamers, pins, screws, broaches
  in_plane,  // in the plane of its blade: saws
  any,       // in any direction: burs, solids of any form
};
[[nodiscard]] Feeding feeding(ToolKind kind) noexcept;
[[nodiscard]] bool feeds_along_axis(ToolKind kind) noexcept;

// Largest number of points of the haptic loop, including those that fill up groups.
inline constexpr int kMostContactPoints = 8192;

// Points on a tool's surface take up to 0.2 s. Everything else of its model takes less than a millisecond.
enum class ToolPoints : std::uint8_t { now, later };

struct ToolModel {
  Tool tool;
  Implicit solid;  // cutting part and shank, of a saw over its whole stroke; made once
  Feeding feed = Feeding::along;
  bool axial = false;                 // feed is along
  CutShape outline;                   // the form that it removes
  int cut_level = 0;                  // level of its cuts: the tool's own or the finest of the case
  double fine_pitch_mm = 0;           // of that level
  double inset = 0;                   // mm, see ContactPoint
  double least_facing = 0.2;          // faces with less than this along the feed neither cut nor resist
  std::vector<ContactPoint> active;   // on the part that cuts
  std::vector<ContactPoint> passive;  // walls and shank: they only block
  ContactSet contact;                 // both, in the same order
  DensityTable strength;              // milling_resistance() of 1 mm2 at 1 mm from the axis
  double active_area_mm2 = 0;
  double wear = 1.0;
  const ForceLaw* law = nullptr;  // never null
  LawTool law_tool;
  SpindleParams spindle;
  Vec3 stroke = Vec3::Zero();  // of a saw: direction in which its teeth oscillate, tool frame; zero: it turns or stands

  // `pitch_mm`: h of the case. The law is the tool's own, or its kind's if it names none. Whoever loads a tool has
  // checked that the law fits (choose_law); otherwise this aborts. `points`: minimum number on the cutting part; 0:
  // chosen from the tool's size.
  ToolModel(const Tool& tool, double pitch_mm, double wear = 1.0, int points = 0);
  // As the constructor, but uses the law of this name, if it is not empty. Error invalid_input: that of choose_law.
  [[nodiscard]] static Result<ToolModel> make(const Tool& tool, double pitch_mm, double wear, std::string_view law_name,
                                              ToolPoints when = ToolPoints::now);
  // Makes active, passive, contact and active_area_mm2 of a model without points. It reads and writes neither wear nor
  // law.
  void make_points(int points = 0);
  [[nodiscard]] bool has_points() const noexcept { return contact.groups() > 0; }

 private:
  ToolModel(const Tool& tool, double pitch_mm, double wear, const ForceLaw& law);
};

}  // namespace osteon::haptic
