// The table of the force laws.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/mechanics/allotta.hpp"
#include "common/mechanics/broaching.hpp"
#include "common/mechanics/burring.hpp"
#include "common/mechanics/drilling.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/mechanics/milling.hpp"
#include "common/mechanics/point_force.hpp"
#include "common/mechanics/reaming.hpp"
#include "common/mechanics/sawing.hpp"
#include "common/tools/tool_file.hpp"

namespace osteon {
namespace {

RevolutionsPerMinute speed_of(const LawInputs& in) noexcept { return RevolutionsPerMinute{in.spindle_rpm}; }
GramsPerCm3 density_of(const LawInputs& in) noexcept { return GramsPerCm3{in.density_g_cm3}; }
double heel_feed(const LawTool& tool, const LawInputs& in) noexcept {
  return tool.heel_mm_per_rev * in.spindle_rpm / 60.0;
}
double arm_mm(const LawTool& tool, const LawInputs& in) noexcept {
  return in.mean_arm_mm > 0.0 ? in.mean_arm_mm : tool.arm_mm;
}
double edges_mm(const LawTool& tool, const LawInputs& in) noexcept {
  return in.edge_length_mm > 0.0 ? in.edge_length_mm : in.engaged * tool.edge_length_mm;
}
double area_mm2(const LawTool& tool, const LawInputs& in) noexcept {
  return in.engaged_area_mm2 > 0.0 ? in.engaged_area_mm2 : in.engaged * tool.leading_area_mm2;
}
bool stands(const LawInputs& in) noexcept { return in.spindle_rpm < kMinCuttingRpm; }

DrillingParams drilling_of(const LawTool& tool, const LawInputs& in) noexcept {
  return {.diameter_mm = tool.diameter_mm,
          .point_angle_rad = tool.point_angle_rad,
          .wear = in.wear,
          .heel_mm_per_rev = tool.heel_mm_per_rev};
}
// For laws without a known torque: two lips whose cutting force makes the thrust, M = T D / (4 sin(beta/2)) [A].
double lips_torque(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return drilling_torque(drilling_of(tool, in), Newtons{thrust_n}).value();
}
double rubbing_below_n(const LawTool& tool, const LawInputs& in) noexcept {
  return drilling_law(drilling_of(tool, in), RevolutionsPerMinute{kMinCuttingRpm}, density_of(in), in.engaged)
      .threshold_n;
}

FeedLaw chi(const LawTool& tool, const LawInputs& in) noexcept {
  return drilling_law(drilling_of(tool, in), speed_of(in), density_of(in), in.engaged);
}

FeedLaw allotta(const LawTool& tool, const LawInputs& in) noexcept {
  if (stands(in)) return {};
  const AllottaParams params{.diameter_mm = tool.diameter_mm, .point_angle_rad = tool.point_angle_rad, .wear = in.wear};
  return {.offset_n = 0.0,
          .scale_n = in.engaged * allotta_thrust(params, 60.0 / in.spindle_rpm, density_of(in)).value(),
          .exponent = 1.0,
          .max_feed_mm_per_s = heel_feed(tool, in),
          .threshold_n = rubbing_below_n(tool, in)};
}

AgusParams agus_of(const LawTool& tool, const LawInputs& in) noexcept {
  return {.radius_mm = 0.5 * tool.diameter_mm, .wear = in.wear};
}
FeedLaw agus(const LawTool& tool, const LawInputs& in) noexcept {
  const AgusParams params = agus_of(tool, in);
  const double per_newton =
      agus_erosion(params, speed_of(in), Newtons{1.0}, arm_mm(tool, in), area_mm2(tool, in), density_of(in)).value();
  if (stands(in) || !(per_newton > 0.0)) return {};
  return {.offset_n = 0.0,
          .scale_n = 1.0 / per_newton,
          .exponent = 1.0,
          .max_feed_mm_per_s = heel_feed(tool, in),
          .threshold_n = 0.0};
}
double agus_across(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return agus_friction(agus_of(tool, in), Newtons{thrust_n}, arm_mm(tool, in)).value();
}
double agus_torque(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return agus_across(tool, in, thrust_n) * arm_mm(tool, in);
}

MillingParams milling_of(const LawTool& tool, const LawInputs& in) noexcept {
  return {.diameter_mm = tool.diameter_mm, .wear = in.wear, .heel_mm_per_rev = tool.heel_mm_per_rev};
}
FeedLaw milling(const LawTool& tool, const LawInputs& in) noexcept {
  const MillingParams params = milling_of(tool, in);
  // Without a sum over points: the whole engaged area at its mean distance.
  const double mean = milling_resistance(params, area_mm2(tool, in), arm_mm(tool, in), in.density_g_cm3);
  return milling_law(params, speed_of(in), in.milling_sum > 0.0 ? in.milling_sum : mean, edges_mm(tool, in),
                     density_of(in));
}
double milling_across(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  const MillingParams params = milling_of(tool, in);
  const double ploughing_n = milling_ploughing(params, edges_mm(tool, in), density_of(in)).value();
  return milling_radial(params, Newtons{std::max(0.0, thrust_n - ploughing_n)}).value();
}
double milling_torque(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return thrust_n * arm_mm(tool, in);
}

// Proportional to the fraction of the point in bone, and to the tool's diameter relative to the drill of the fit [A].
FeedLaw spring_damper(const LawTool& tool, const LawInputs& in) noexcept {
  if (stands(in)) return {};
  const SpringDamperParams params{.wear = in.wear};
  const double share = in.engaged * tool.diameter_mm / kReferenceDiameter_mm;
  const double at_one = spring_damper_thrust_n(params, 1.0, in.density_g_cm3);
  const double at_two = spring_damper_thrust_n(params, 2.0, in.density_g_cm3);
  return {.offset_n = share * (2.0 * at_one - at_two),
          .scale_n = share * (at_two - at_one),
          .exponent = 1.0,
          .max_feed_mm_per_s = heel_feed(tool, in),
          .threshold_n = 0.0};
}

FeedLaw multi_point(const LawTool& tool, const LawInputs& in) noexcept {
  if (stands(in)) return {};
  // Without a sum over points: the cone of the point, whose normals lean by half its angle.
  const double directed = in.directed_density > 0.0
                              ? in.directed_density
                              : in.engaged * in.density_g_cm3 * std::sin(0.5 * tool.point_angle_rad);
  const double per_newton = multi_point_feed_mm_per_s({.wear = in.wear}, 1.0, directed);
  return {.offset_n = 0.0,
          .scale_n = per_newton > 0.0 ? 1.0 / per_newton : 0.0,
          .exponent = 1.0,
          .max_feed_mm_per_s = heel_feed(tool, in),
          .threshold_n = rubbing_below_n(tool, in)};
}

SawingParams sawing_of(const LawTool& tool, double wear) noexcept {
  return {.stroke_mm = tool.stroke_mm, .tooth_pitch_mm = tool.tooth_pitch_mm, .wear = wear};
}
double teeth_in(const LawTool& tool, const LawInputs& in) noexcept {
  return in.teeth_engaged > 0.0 ? in.teeth_engaged : in.engaged * tool.teeth;
}
FeedLaw saw(const LawTool& tool, const LawInputs& in) noexcept {
  return sawing_law(sawing_of(tool, in.wear), speed_of(in), density_of(in), teeth_in(tool, in));
}
double saw_torque(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return thrust_n > 0.0 ? sawing_torque(sawing_of(tool, in.wear), density_of(in), teeth_in(tool, in)).value() : 0.0;
}
double saw_across(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return thrust_n > 0.0 ? sawing_cutting_force(sawing_of(tool, in.wear), density_of(in), teeth_in(tool, in)).value()
                        : 0.0;
}

ReamingParams reaming_of(const LawTool& tool, const LawInputs& in) noexcept {
  return {.teeth = tool.teeth, .heel_mm_per_rev = tool.heel_mm_per_rev, .wear = in.wear};
}
FeedLaw reamer(const LawTool& tool, const LawInputs& in) noexcept {
  return reaming_law(reaming_of(tool, in), speed_of(in), edges_mm(tool, in), density_of(in));
}
double reamer_torque(const LawTool& tool, const LawInputs& in, double thrust_n) noexcept {
  return reaming_torque(reaming_of(tool, in), Newtons{thrust_n}, edges_mm(tool, in), density_of(in), arm_mm(tool, in))
      .value();
}

FeedLaw broach(const LawTool& tool, const LawInputs& in) noexcept {
  return broaching_law({.wear = in.wear}, speed_of(in), area_mm2(tool, in), density_of(in));
}
double no_torque(const LawTool&, const LawInputs&, double) noexcept { return 0.0; }

bool is_saw(ToolKind kind) noexcept { return kind == ToolKind::oscillating_saw || kind == ToolKind::reciprocating_saw; }
bool is_broach(ToolKind kind) noexcept { return kind == ToolKind::broach; }
// Tools whose point goes ahead of their flutes. A screw is none: it cuts by its thread, at a tenth of such speeds.
bool is_drill(ToolKind kind) noexcept {
  return kind == ToolKind::drill || kind == ToolKind::end_drill || kind == ToolKind::pin;
}
bool is_round_burr(ToolKind kind) noexcept { return kind == ToolKind::round_burr; }
bool mills(ToolKind kind) noexcept {
  return is_round_burr(kind) || kind == ToolKind::barrel_burr || kind == ToolKind::contoured_burr ||
         kind == ToolKind::mesh;
}
bool is_reamer(ToolKind kind) noexcept {
  return kind == ToolKind::sphere_reamer || kind == ToolKind::cylinder_reamer || kind == ToolKind::outside_reamer;
}
bool any(ToolKind) noexcept { return true; }

constexpr std::array kLaws{
    ForceLaw{.name = "chi",
             .title = "Drilling thrust by regression",
             .equation = "T = 134.6 N^-0.3327 v^0.5189 rho^1.1841 (D/3.2); M = T D / (4 sin(beta/2))",
             .number = "7.3",
             .source = "Chi et al. 2005",
             .inputs = "N rpm, v mm/s, rho g/cm3, D mm, beta rad; T N, M N mm",
             .constants = "rubs below 1 N at 1.9 g/cm3 [A]; heel at 0.33 D a turn [A]",
             .wear = "T and M in proportion; a blunt drill (2) needs twice the thrust and advances at 0.26 of the feed",
             .range = "drills and pins of 1.6 to 10 mm [A], 0.3 to 2.0 g/cm3, 500 to 3000 rpm, 0.5 to 3 mm/s",
             .notes =
                 "The drill of the regression is not stated: thrust grows as D/3.2 [A]. It gives no torque; that is "
                 "of two lips [A]. No limit at N = 0: a spindle below 50 rpm counts as standing.",
             .limits = {.spindle_rpm = {500, 3000},
                        .feed_mm_per_s = {0.5, 3.0},
                        .density_g_cm3 = {0.3, 2.0},
                        .diameter_mm = {1.6, 10.0}},
             .fits = is_drill,
             .feed_law = chi,
             .torque_nmm = lips_torque},
    ForceLaw{
        .name = "allotta",
        .title = "Drilling thrust and torque from the energy of a unit of volume",
        .equation = "T = K_s a (D/2) sin(beta/2), K_s = 5 R_u; M = 5 R_u a D^2/8; a = 60 v/N",
        .number = "7.1-7.2",
        .source = "Allotta et al. 1996",
        .inputs = "a mm per turn, N rpm, v mm/s, D mm, beta rad, R_u MPa; T N, M N mm",
        .constants = "R_u = 130 (rho/1.9)^2 MPa [A]; beta is the tool's own; heel at 0.33 D a turn [A]",
        .wear = "K_s in proportion, so T and M; a blunt drill (2) advances at half the feed",
        .range = "drills and pins of 2.5 to 8 mm in cortical bone, K_s 4.8 to 6 R_u",
        .notes =
            "a is for a turn, not a second. The torque's work in a turn is K_s for each mm3. About 1.85 times Chi at "
            "1000 rpm, 1 mm/s, 3.2 mm.",
        .limits = {.density_g_cm3 = {1.5, 2.1}, .diameter_mm = {2.5, 8.0}},
        .fits = is_drill,
        .feed_law = allotta,
        .torque_nmm = lips_torque},
    ForceLaw{
        .name = "agus",
        .title = "Burring as erosion under Hertz's contact",
        .equation = "F_e = C1 R^2 (h/R)^1.5, F_mu = mu F_e along omega x r; v = mu F omega r / (u A)",
        .number = "7.4-7.6",
        .source = "Agus et al. 2002",
        .inputs = "h mm, R mm, omega rad/s, r mm (mean distance from the axis), A mm2 (on the feed), rho g/cm3; F N, "
                  "v mm/s",
        .constants = "C1 25 GPa; mu 0.3 [A]; u 1 J/mm3 at 1.9 g/cm3 [A], growing as rho^1.1841 [A]; heel at 5 usual "
                     "feeds a turn [A]",
        .wear = "u in proportion: a blunt burr (2) erodes at half the feed",
        .range = "round burs on cortical bone, 10000 to 80000 rpm [A]",
        .notes = "The elastic depth is microns: what a hand feels along the feed is the erosion. h is asked only for "
                 "how wide the contact is: across the feed and as torque comes F_mu, mu F but for places within some "
                 "widths of the pole. Nothing is cut at the pole.",
        .limits = {.spindle_rpm = {10'000, 80'000}, .density_g_cm3 = {1.5, 2.1}},
        .fits = is_round_burr,
        .feed_law = agus,
        .torque_nmm = agus_torque,
        .across_n = agus_across},
    ForceLaw{
        .name = "milling",
        .title = "Milling force from the rate of removal",
        .equation = "F_t = K_t MRR / v_c + k_e L, v_c = omega r; F_r = K_r (F_t - k_e L) [A]",
        .number = "7.7-7.8",
        .source = "Yang and Chen 2003; Choi and Jerard 1998; Eriksson et al. 2005 for bone",
        .inputs = "MRR mm3/s, v_c mm/s, L mm of edge in bone, rho g/cm3; F N",
        .constants = "K_t 200 N/mm2, K_r 0.5, k_e 0.01 N/mm at 1.9 g/cm3 [A], growing as rho^1.1841 [A]; heel at 5 "
                     "usual feeds a turn [A]",
        .wear = "K_t and k_e in proportion, so F_t and F_r",
        .range = "burs and other solids of any form; assumed: 5000 to 80000 rpm, 0.2 to 2.1 g/cm3 [A]",
        .notes =
            "As printed, K_t MRR / f with the feed f, the force does not depend on the feed and cannot be solved "
            "for it; and F_r is of all of F_t, here not of the edges that only plough [A]. F_t is felt against the "
            "feed and as torque, F_r across the feed [A]. Below 0.15 R the cutting speed is taken as constant: at "
            "the pole it hardly cuts.",
        .limits = {.spindle_rpm = {5'000, 80'000}, .density_g_cm3 = {0.2, 2.1}},
        .fits = mills,
        .feed_law = milling,
        .torque_nmm = milling_torque,
        .across_n = milling_across},
    ForceLaw{
        .name = "spring-damper",
        .title = "Spring and damper of the surface",
        .equation = "F = t_s N/|N| - t_r V, along the feed t_s + t_r v",
        .number = "7.9-7.11",
        .source = "Avila and Sobierajski 1996; McNeely et al. 1999; Hua and Qin 2002",
        .inputs = "v mm/s, rho g/cm3; F N",
        .constants = "t_s 5 N, t_r 24 N s/mm at 1.9 g/cm3 [A: fitted to Chi at 1 mm/s], growing as rho^1.1841 and "
                     "D/3.2 [A]",
        .wear = "t_s and t_r in proportion",
        .range = "near the fit: 0.5 to 2 mm/s, 0.3 to 2.0 g/cm3",
        .notes =
            "It does not know the spindle's speed. The surface's normal is taken as the feed's own direction [A], "
            "so the spring is felt inside even bone too, where the density's gradient, which gives N, vanishes. It "
            "gives no torque; that is of two lips [A].",
        .limits = {.feed_mm_per_s = {0.5, 2.0}, .density_g_cm3 = {0.3, 2.0}},
        .fits = any,
        .feed_law = spring_damper,
        .torque_nmm = lips_torque},
    ForceLaw{
        .name = "multi-point",
        .title = "Sum over the contact points",
        .equation = "along the feed F = K1 v sum K2_i D_i max(0, -n_i v/|v|), of K1 K2_i D_i |v| n_i where -n_i v > 0",
        .number = "7.12, 7.14",
        .source = "Niu 2008; there is no 7.13",
        .inputs = "v mm/s, D g/cm3, K2 share of the active area, n inward normal; F N",
        .constants = "K1 17.7 N s/mm per g/cm3 [A: fitted to Chi at 1 mm/s, 1.9 g/cm3 and a 118 degree point]",
        .wear = "K1 in proportion",
        .range = "near the fit: 0.5 to 2 mm/s",
        .notes =
            "As printed it pushes during retraction too: here only points that move into bone count. A "
            "tool cuts as it is fed, so every point's own velocity is the feed's; turning it cuts nothing. It knows "
            "neither the spindle's speed nor the diameter. It gives no torque; that is of two lips [A].",
        .limits = {.feed_mm_per_s = {0.5, 2.0}},
        .fits = any,
        .feed_law = multi_point,
        .torque_nmm = lips_torque},
    ForceLaw{.name = "saw",
             .title = "Sawing from single teeth",
             .equation =
                 "F = 0.15 n 7.5 (1 + 0.30 (d - 2)/8) N, v pitch = 0.15 d 2 stroke strokes/s; F_c = 0.15 n 4 N along "
                 "the stroke; M = F_c stroke/pi",
             .number = "",
             .source = "James, Pearlman and Saigal 2012, 2013",
             .inputs = "n teeth in bone, d um of depth per tooth, v mm/s, stroke mm, pitch mm, rho g/cm3; F N, M N mm",
             .constants =
                 "7.5 N of thrust at 2 um, 4 N along the cut at 1.9 g/cm3 [A: resultant 8 to 11 N]; 0.15 of the teeth "
                 "bear at a time [A]; at most 20 um [A]",
             .wear = "thrust and cutting force of each tooth in proportion",
             .range = "saws: 2 to 10 um a tooth, teeth at 1700 to 7000 mm/s, cortical bone",
             .notes = "At the same depth of cut the speed has no effect. Below the thrust at no depth the teeth rub.",
             .limits = {.density_g_cm3 = {1.5, 2.1}, .depth_um = {2, 10}, .tooth_mm_per_s = {1700, 7000}},
             .fits = is_saw,
             .feed_law = saw,
             .torque_nmm = saw_torque,
             .across_n = saw_across},
    ForceLaw{.name = "reamer",
             .title = "Reaming as milling along the axis",
             .equation = "T = (K_r K_t t + k_e) L, t = 60 v/(N Z); M = (K_t t + k_e) L r",
             .number = "",
             .source = "as milling, 7.7-7.8 [A]",
             .inputs =
                 "L mm of edge in bone, Z teeth, N rpm, v mm/s, r mm (mean distance from the axis), rho g/cm3; T N, "
                 "M N mm",
             .constants = "K_t 200 N/mm2, K_r 0.5, k_e 0.01 N/mm at 1.9 g/cm3 [A]; heel at 5 usual feeds a turn [A]",
             .wear = "K_t and k_e in proportion, so T and M",
             .range = "reamers; assumed: 50 to 600 rpm, 0.1 to 2.0 g/cm3 [A]",
             .notes = "Nothing was measured for it: for the order of size and the way it scales.",
             .limits = {.spindle_rpm = {50, 600}, .density_g_cm3 = {0.1, 2.0}},
             .fits = is_reamer,
             .feed_law = reamer,
             .torque_nmm = reamer_torque},
    ForceLaw{.name = "broach",
             .title = "Broaching by blows of a mallet",
             .equation = "advance = 0.7 J^2/(2 m R), R = 130 (rho/1.9)^2 A; seated below 0.1 mm a blow",
             .number = "",
             .source = "work and energy [A]",
             .inputs =
                 "J N s of a blow, m kg of the mallet, A mm2 of wall and face in bone (on the advance), rho g/cm3; R N",
             .constants = "J 2.8 N s, m 0.7 kg, at most 5 mm a blow, held with 5 N [A]",
             .wear = "R in proportion: a blunt broach (2) advances half as far at a blow",
             .range = "broaches; assumed: 0.1 to 1.0 g/cm3, 20 to 120 blows a minute [A]",
             .notes = "The push of the hand hardly matters: the blows advance it, and it stops when seated.",
             .limits = {.spindle_rpm = {20, 120}, .density_g_cm3 = {0.1, 1.0}},
             .fits = is_broach,
             .feed_law = broach,
             .torque_nmm = no_torque},
};

bool outside(const Span& span, double value) noexcept {
  return (span.lowest != 0.0 || span.highest != 0.0) && !(value >= span.lowest && value <= span.highest);
}

}  // namespace

std::span<const ForceLaw> force_laws() { return kLaws; }

const ForceLaw* find_force_law(std::string_view name) {
  const auto found = std::ranges::find(kLaws, name, &ForceLaw::name);
  return found == kLaws.end() ? nullptr : &*found;
}

const ForceLaw& default_law(const Tool& tool) {
  const auto name = [&]() -> std::string_view {
    switch (tool.kind) {
      case ToolKind::drill:
      case ToolKind::end_drill:
      case ToolKind::pin:
        return "chi";
      case ToolKind::round_burr:
      case ToolKind::barrel_burr:
      case ToolKind::contoured_burr:
        return "milling";
      case ToolKind::oscillating_saw:
      case ToolKind::reciprocating_saw:
        return "saw";
      case ToolKind::sphere_reamer:
      case ToolKind::cylinder_reamer:
      case ToolKind::outside_reamer:
        return "reamer";
      case ToolKind::broach:
        return "broach";
      default:
        return "multi-point";  // screws and solids of any form; for tools that do not cut it is never used
    }
  }();
  return *find_force_law(name);
}

Result<const ForceLaw*> choose_law(const Tool& tool, std::string_view name) {
  const std::string_view wanted = name.empty() ? std::string_view(tool.law) : name;
  if (wanted.empty()) return &default_law(tool);
  const ForceLaw* law = find_force_law(wanted);
  if (law && law->fits(tool.kind)) return law;
  std::string fitting;
  for (const ForceLaw& one : kLaws)
    if (one.fits(tool.kind)) fitting += (fitting.empty() ? "" : ", ") + std::string(one.name);
  const std::string quoted = "\"" + std::string(wanted) + "\"";
  const std::string what = law ? "the force law " + quoted + " is not for a " + std::string(kind_name(tool.kind))
                               : "there is no force law " + quoted;
  return failure(ErrorCode::invalid_input, tool.name + ": " + what + "; choose one of " + fitting);
}

unsigned out_of_range(const ForceLaw& law, const LawTool& tool, const LawInputs& inputs,
                      double feed_mm_per_s) noexcept {
  unsigned bits = 0;
  const auto check = [&](OutOfRange bit, const Span& span, double value) {
    if (outside(span, value)) bits |= static_cast<unsigned>(bit);
  };
  check(OutOfRange::speed, law.limits.spindle_rpm, inputs.spindle_rpm);
  check(OutOfRange::feed, law.limits.feed_mm_per_s, feed_mm_per_s);
  check(OutOfRange::density, law.limits.density_g_cm3, inputs.density_g_cm3);
  check(OutOfRange::diameter, law.limits.diameter_mm, tool.diameter_mm);
  const SawingParams teeth = sawing_of(tool, inputs.wear);
  check(OutOfRange::depth_of_cut, law.limits.depth_um,
        depth_of_cut_um(teeth, speed_of(inputs), MillimetresPerSecond{feed_mm_per_s}));
  check(OutOfRange::tooth_speed, law.limits.tooth_mm_per_s, tooth_speed(teeth, speed_of(inputs)).value());
  return bits;
}

std::span<const std::string_view> out_of_range_names() {
  static constexpr std::string_view kNames[] = {"speed",    "feed",         "density",
                                                "diameter", "depth of cut", "speed of the teeth"};
  return kNames;
}

std::string out_of_range_words(unsigned bits) {
  std::string what;
  for (const std::string_view name : out_of_range_names()) {
    if (bits & 1u) what += (what.empty() ? "" : ", ") + std::string(name);
    bits >>= 1;
  }
  return what;
}

std::string out_of_range_sentence(const ForceLaw& law, unsigned bits) {
  const std::string what = out_of_range_words(bits);
  if (what.empty()) return {};
  return "the law \"" + std::string(law.name) + "\" is used outside its range (" + std::string(law.range) +
         "): " + what;
}

}  // namespace osteon
