// The force laws of Niu 2008, chapter 7, and of tools not treated there, in one table. Each law turns speed, density
// and engagement of a moment into a FeedLaw: resistance as a function of feed. The law of a tool can be chosen, because
// the laws disagree with each other. force_laws.cpp is the table. The header of each law has its equations.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "common/mechanics/feed_law.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// The sums over the contact points at a moment. A law's unused inputs may stay at their defaults.
struct LawInputs {
  double spindle_rpm = 0;       // turns, strokes or blows per minute
  double density_g_cm3 = 0;     // engaged-area weighted
  double engaged = 0;           // 0 to 1: fraction of the leading area, projected on the feed, that is in bone
  double engaged_area_mm2 = 0;  // that area
  double milling_sum = 0;  // sum of milling_resistance() of a sharp tool (MillingParams::wear 1), N·s/mm per rad/s
  double directed_density =
      0;  // sum over engaged points: (share of active area) · density · max(0, -inward·feed), g/cm3
  // total length of the cutting edges in bone, of all teeth; counted as in LawTool; 0: derived from `engaged`
  double edge_length_mm = 0;
  double mean_arm_mm = 0;    // mean distance of the engaged area from the axis; 0: LawTool::arm_mm
  double teeth_engaged = 0;  // of a saw; 0: derived from `engaged`
  double wear = 1.0;         // 1 sharp; a blunt tool needs about twice the thrust
};

// Properties of the tool that laws use.
struct LawTool {
  double diameter_mm = 3.2;                  // of the cutting part; of a screw, its core
  double point_angle_rad = 2.0594885173533;  // full angle; pi for flat or round points
  double teeth = 2;                          // flutes, teeth
  // feed per turn at which the back of the edge touches; of a screw, the pitch of its thread
  double heel_mm_per_rev = 1.056;
  double arm_mm = 0.8;           // mean distance at which the cutting force acts
  double edge_length_mm = 3.73;  // of all cutting edges that face the feed
  double stroke_mm = 0;          // saw: distance of the teeth from end to end
  double tooth_pitch_mm = 0;     // saw
  double leading_area_mm2 = 0;   // projected on the usual feed direction
};
[[nodiscard]] LawTool law_tool(const Tool& tool);

// The range in which a law was measured. Two zeros: unknown.
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
  std::string_view number;     // of the equations in the dissertation; empty if it has none
  std::string_view source;     // who measured or derived it
  std::string_view inputs;     // with their units
  std::string_view constants;  // with their units; [A] marks an assumption
  std::string_view wear;       // how LawInputs::wear enters
  std::string_view range;      // in words
  std::string_view notes;
  LawRange limits = {};
  bool (*fits)(ToolKind kind) noexcept = nullptr;  // whether it can be chosen for such a tool
  // [haptic] Any thread. A stopped spindle gives the law that does not cut: no feed at all.
  FeedLaw (*feed_law)(const LawTool& tool, const LawInputs& inputs) noexcept = nullptr;
  // [haptic] Torque on the spindle, N mm, for a resistance along the feed. For saws, the torque of the same power.
  double (*torque_nmm)(const LawTool& tool, const LawInputs& inputs, double thrust_n) noexcept = nullptr;
  // [haptic] Force across the feed for a resistance along it, N. For rotating tools, it acts against the motion of the
  // flank. For saws, it acts along the stroke and changes direction with the teeth. Null: the forces of all edges
  // cancel, or the law does not define it.
  double (*across_n)(const LawTool& tool, const LawInputs& inputs, double thrust_n) noexcept = nullptr;
};

[[nodiscard]] std::span<const ForceLaw> force_laws();
[[nodiscard]] const ForceLaw* find_force_law(std::string_view name);  // null if no law has this name
// The law by the tool's kind, if none is chosen. For a tool that does not cut, a law that is never used.
[[nodiscard]] const ForceLaw& default_law(const Tool& tool);
// The law that the tool's definition names (Tool::law), or its default. A non-empty `name` replaces both. Errors name
// the laws that fit.
[[nodiscard]] Result<const ForceLaw*> choose_law(const Tool& tool, std::string_view name = {});

// [haptic] The limits outside which a law is used, as bits. Zero: within all limits.
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
// Name of each bit, the lowest first.
[[nodiscard]] std::span<const std::string_view> out_of_range_names();
[[nodiscard]] std::string out_of_range_words(unsigned bits);                          // "speed, feed"; "" for zero
[[nodiscard]] std::string out_of_range_sentence(const ForceLaw& law, unsigned bits);  // "" for zero

}  // namespace osteon
