// The force laws of chapter 7 and of the tools that it does not treat, one table: each law turns speed, density and
// engagement of a moment into a FeedLaw, resistance as a function of feed. Which one a tool obeys is a choice: the laws
// disagree with each other. force_laws.cpp is the table, each law's own header its equations.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "common/mechanics/feed_law.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// What the contact points say together at a moment. Everything that a law does not use may be left at its default.
struct LawInputs {
  double spindle_rpm = 0;       // turns, strokes or blows a minute
  double density_g_cm3 = 0;     // engaged-area weighted
  double engaged = 0;           // 0 to 1: bone's share of the leading area, projected on the feed
  double engaged_area_mm2 = 0;  // that area
  double milling_sum = 0;  // sum of milling_resistance() of a sharp tool (MillingParams::wear 1), N·s/mm per rad/s
  double directed_density =
      0;  // sum over engaged points of share of the active area · density · max(0, -inward·feed), g/cm3
  double edge_length_mm = 0;  // of the cutting edges in bone, all teeth, as LawTool counts them; 0: as `engaged` says
  double mean_arm_mm = 0;     // of the engaged area from the axis; 0: LawTool::arm_mm
  double teeth_engaged = 0;   // of a saw; 0: as `engaged` says
  double wear = 1.0;          // 1 sharp; a blunt tool needs about twice the thrust
};

// What a law wants to know of the tool.
struct LawTool {
  double diameter_mm = 3.2;                  // of the cutting part; of a screw its core
  double point_angle_rad = 2.0594885173533;  // full angle; pi where flat or round
  double teeth = 2;                          // flutes, teeth
  double heel_mm_per_rev = 1.056;  // feed per turn at which the back of the edge touches; of a screw its thread's pitch
  double arm_mm = 0.8;             // distance at which the cutting force acts on average
  double edge_length_mm = 3.73;    // of all cutting edges that look into the feed
  double stroke_mm = 0;            // saw: way of the teeth from end to end
  double tooth_pitch_mm = 0;       // saw
  double leading_area_mm2 = 0;     // projected on the usual direction of feed
};
[[nodiscard]] LawTool law_tool(const Tool& tool);

// Where a law was measured; a pair of zeros: nothing is said.
struct Span {
  double lowest = 0, highest = 0;
};
struct LawRange {
  Span spindle_rpm = {}, feed_mm_per_s = {}, density_g_cm3 = {}, diameter_mm = {};
  Span depth_um = {}, tooth_mm_per_s = {};  // saw: depth of cut of a tooth, mean speed of the teeth
};

struct ForceLaw {
  std::string_view name;  // "chi": in tool files and on the command line
  std::string_view title;
  std::string_view equation;
  std::string_view number;     // of the equations in the dissertation; empty where it has none
  std::string_view source;     // who measured or derived it
  std::string_view inputs;     // with their units
  std::string_view constants;  // with their units; [A] marks an assumption
  std::string_view wear;       // how LawInputs::wear enters
  std::string_view range;      // in words
  std::string_view notes;
  LawRange limits = {};
  bool (*fits)(ToolKind kind) noexcept = nullptr;  // whether it can be chosen for such a tool
  // [haptic] Any thread. A spindle that stands gives the law that does not cut: no feed at all.
  FeedLaw (*feed_law)(const LawTool& tool, const LawInputs& inputs) noexcept = nullptr;
  // [haptic] Torque on the spindle, N mm, that goes with a resistance along the feed; of saws the torque of equal
  // power.
  double (*torque_nmm)(const LawTool& tool, const LawInputs& inputs, double thrust_n) noexcept = nullptr;
  // [haptic] Force across the feed that goes with a resistance along it, N: of what turns, against the motion of its
  // flank; of saws along the teeth's stroke, to and fro with them. Null: those of all edges cancel, or the law says
  // nothing of it.
  double (*across_n)(const LawTool& tool, const LawInputs& inputs, double thrust_n) noexcept = nullptr;
};

[[nodiscard]] std::span<const ForceLaw> force_laws();
[[nodiscard]] const ForceLaw* find_force_law(std::string_view name);  // null: there is none of this name
// The law of a tool for which none is chosen, by its kind. Of one that does not cut: one that nobody asks.
[[nodiscard]] const ForceLaw& default_law(const Tool& tool);
// The law that the tool's own definition names (Tool::law), its default where it names none. `name`: instead of that,
// if it is not empty. Errors name the laws that fit.
[[nodiscard]] Result<const ForceLaw*> choose_law(const Tool& tool, std::string_view name = {});

// [haptic] Outside of which of its limits a law is used, as bits; zero: within all.
enum class OutOfRange : std::uint8_t {
  speed = 1,
  feed = 2,
  density = 4,
  diameter = 8,
  depth_of_cut = 16,
  tooth_speed = 32
};
[[nodiscard]] unsigned out_of_range(const ForceLaw& law, const LawTool& tool, const LawInputs& inputs,
                                    double feed_mm_per_s) noexcept;
// What each bit is called, the lowest first.
[[nodiscard]] std::span<const std::string_view> out_of_range_names();
[[nodiscard]] std::string out_of_range_words(unsigned bits);                          // "speed, feed"; "" for zero
[[nodiscard]] std::string out_of_range_sentence(const ForceLaw& law, unsigned bits);  // "" for zero

}  // namespace osteon
