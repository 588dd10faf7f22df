// The feel of drilling, burring and guided drilling in numbers. Runs the reference simulations of the feed rig and of
// the hands on virtual time. Shows how they change with push, wear, stiffness, damping, tick and pitch, and the forces
// of a burr over time.
// Takes what to run (rig, hands, steps, profiles, guided) and prints JSON with the numbers and the curves.
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

using nlohmann::json;

constexpr double kCone_mm = 0.961;  // height of a 118° point of 3.2 mm
// Depths of the tip between which the whole point is in one layer, away from where neighbouring densities mix.
constexpr double kFrom_mm[] = {1.5, 7.0, 27.0}, kTo_mm[] = {3.9, 23.9, 28.9};

double rounded(double value) { return std::round(1e4 * value) / 1e4; }

PlanStep drill_step(HandKind hand) {
  PlanStep step = straight_down("drill-3.2", hand);
  step.feed_mm_per_s = 1.0;
  step.beyond_mm = 3.0;
  return step;
}

// A hole through the layered block.
struct Hole {
  double force_n[3] = {}, feed_mm_per_s[3] = {};  // near cortex, medulla, far cortex
  double ramp_mm = 0;                             // of the tip while the point becomes engaged: see Ramp
  double after_exit_n = 0;                        // the largest force after the cone's exit
  double plunge_mm = 0, after_exit_mm = 0;
  bool completed = false;
  json curve = {
      {"time_s", json::array()}, {"depth_mm", json::array()}, {"force_n", json::array()}, {"engaged", json::array()}};

  [[nodiscard]] json numbers() const {
    json out{{"ramp_mm", rounded(ramp_mm)},
             {"after_exit_n", rounded(after_exit_n)},
             {"plunge_mm", rounded(plunge_mm)},
             {"after_exit_mm", rounded(after_exit_mm)},
             {"completed", completed}};
    for (const double f : force_n) out["force_n"].push_back(rounded(f));
    for (const double v : feed_mm_per_s) out["feed_mm_per_s"].push_back(rounded(v));
    return out;
  }
};

// The engaged share of a cone grows as ((z - z0) / height)². Gives the height by the straight line through its root.
struct Ramp {
  double n = 0, z = 0, r = 0, zz = 0, zr = 0;
  void see(double tip_mm, double engaged) {
    const double root = std::sqrt(engaged);
    if (engaged < 0.05 || engaged > 0.95) return;
    n += 1, z += tip_mm, r += root, zz += tip_mm * tip_mm, zr += tip_mm * root;
  }
  [[nodiscard]] double height_mm() const { return n < 3 ? 0.0 : (n * zz - z * z) / (n * zr - z * r); }
};

Hole drill(const PlanStep& step, double dt_s = 1e-3, double pitch_mm = 0.5, bool keep_curve = false) {
  // The room's delays are times and not ticks.
  const auto ticks = [&](double s) { return static_cast<int>(std::lround(s / dt_s)); };
  Bench bench(block_case(12.0, pitch_mm), {step}, {}, 0.0, {ticks(0.012), ticks(0.025)}, dt_s);
  Hole hole;
  int count[3] = {};
  double seconds[3] = {}, time_s = 0.0, deepest_mm = -1e9;
  Ramp ramp;
  const int every = std::max(1, ticks(0.005));
  bench.run([&](const SessionTick& tick) {
    time_s += dt_s;
    const double tip = tick.report.pose_bone_proxy.position_mm.z(), force_n = -tick.report.coupling.force_n.z();
    const bool in = tick.order.phase == SurgeonPhase::push || tick.order.phase == SurgeonPhase::feed;
    if (in && tip < 2.0) ramp.see(tip, tick.report.cutting.engaged);
    if (tip > 30.0 + kCone_mm + 0.3) hole.after_exit_n = std::max(hole.after_exit_n, std::abs(force_n));
    if (in && tip > deepest_mm)
      for (int i = 0; i < 3; ++i)
        if (tip >= kFrom_mm[i] && tip <= kTo_mm[i]) hole.force_n[i] += force_n, ++count[i], seconds[i] += dt_s;
    deepest_mm = std::max(deepest_mm, tip);
    if (!keep_curve || tip < -2.0 || tick.report.state_seq % static_cast<std::uint64_t>(every) != 0) return;
    hole.curve["time_s"].push_back(rounded(time_s));
    hole.curve["depth_mm"].push_back(rounded(tip));
    hole.curve["force_n"].push_back(rounded(force_n));
    hole.curve["engaged"].push_back(rounded(tick.report.cutting.engaged));
  });
  for (int i = 0; i < 3; ++i) {
    hole.force_n[i] /= std::max(1, count[i]);
    hole.feed_mm_per_s[i] = (kTo_mm[i] - kFrom_mm[i]) / std::max(1e-9, seconds[i]);
  }
  hole.ramp_mm = ramp.height_mm();
  const StepResult& result = bench.session().surgeon().results()[0];
  hole.plunge_mm = result.plunge_mm;
  hole.after_exit_mm = result.after_exit_mm;
  hole.completed = bench.session().done() && result.completed;
  return hole;
}

// Independent runs in parallel.
std::vector<Hole> drill_all(const std::vector<PlanStep>& steps) {
  std::vector<Hole> holes(steps.size());
  tbb::parallel_for(std::size_t{0}, steps.size(), [&](std::size_t i) { holes[i] = drill(steps[i]); });
  return holes;
}

json rig() {
  const Hole hole = drill(drill_step(HandKind::rig), 1e-3, 0.5, true);
  json out = hole.numbers();
  out["curve"] = hole.curve;
  return out;
}

// Plunges while one parameter of the hand or the drill is changed.
json sweep(const char* name, const std::vector<double>& values, double PlanStep::*field) {
  json out;
  out["values"] = values;
  for (const HandKind hand : {HandKind::expert, HandKind::novice}) {
    std::vector<PlanStep> steps;
    for (const double value : values) {
      steps.push_back(drill_step(hand));
      steps.back().*field = value;
    }
    const char* who = hand == HandKind::expert ? "expert" : "novice";
    for (const Hole& hole : drill_all(steps)) {
      out[who]["plunge_mm"].push_back(rounded(hole.plunge_mm));
      out[who]["after_exit_mm"].push_back(rounded(hole.after_exit_mm));
      out[who]["far_cortex_n"].push_back(rounded(hole.force_n[2]));
    }
    std::fprintf(stderr, "%s over %s\n", who, name);
  }
  return out;
}

json hands() {
  json out;
  for (const HandKind hand : {HandKind::expert, HandKind::novice}) {
    const Hole hole = drill(drill_step(hand), 1e-3, 0.5, true);
    const HandParams params = Surgeon::hand_for(drill_step(hand));
    json& one = out[hand == HandKind::expert ? "expert" : "novice"];
    one = hole.numbers();
    one["curve"] = hole.curve;
    one["stiffness_n_per_mm"] = params.stiffness_n_per_mm;
    one["damping_n_s_per_mm"] = params.damping_n_s_per_mm;
  }
  out["push_n"] = sweep("push", {20, 24, 29, 34, 40}, &PlanStep::push_n);
  out["wear"] = sweep("wear", {1.0, 1.25, 1.5, 2.0}, &PlanStep::wear);
  out["stiffness_n_per_mm"] = sweep("stiffness", {1.5, 2.0, 3.0, 4.0, 5.5, 8.0}, &PlanStep::hand_stiffness_n_per_mm);
  out["damping_n_s_per_mm"] = sweep("damping", {0.07, 0.1, 0.141, 0.235, 0.4, 0.6}, &PlanStep::hand_damping_n_s_per_mm);
  return out;
}

// The same holes with other ticks and other pitches of the bone.
json steps() {
  struct Case {
    const char* what;
    double dt_s, pitch_mm;
  };
  const Case cases[] = {{"1 kHz, 0.5 mm", 1e-3, 0.5},
                        {"0.5 kHz, 0.5 mm", 2e-3, 0.5},
                        {"2 kHz, 0.5 mm", 5e-4, 0.5},
                        {"1 kHz, 0.25 mm", 1e-3, 0.25},
                        {"1 kHz, 1 mm", 1e-3, 1.0}};
  const HandKind hands[] = {HandKind::rig, HandKind::expert, HandKind::novice};
  std::vector<json> runs(std::size(cases) * std::size(hands));
  tbb::parallel_for(std::size_t{0}, runs.size(), [&](std::size_t i) {
    const Case& c = cases[i / std::size(hands)];
    const HandKind hand = hands[i % std::size(hands)];
    runs[i] = drill(drill_step(hand), c.dt_s, c.pitch_mm).numbers();
    runs[i]["case"] = c.what;
    runs[i]["hand"] = hand == HandKind::rig ? "rig" : hand == HandKind::expert ? "expert" : "novice";
  });
  return runs;
}

// The force on the tool over time while a burr moves to and fro over cortical bone: x along its lines, z into the bone.
json profile(const PlanStep& step) {
  Bench bench(block_case(24.0), {step});
  json out{{"tool", step.tool}, {"sweep_mm_per_s", step.sweep_mm_per_s}};
  double time_s = 0.0;
  bench.run([&](const SessionTick& tick) {
    time_s += 1e-3;
    if (tick.order.phase != SurgeonPhase::sweep || tick.report.state_seq % 4 != 0) return;
    const EntrySite& site = bench.session().surgeon().plan().steps[0].site;
    const auto turned = [&](const Vec3& v) {
      return Vec3(v.dot(site.across_u), v.dot(site.across_v), v.dot(site.axis));
    };
    const Vec3 f = turned(tick.report.coupling.force_n),
               tip = turned(tick.report.pose_bone_proxy.position_mm - site.entry_mm);
    out["time_s"].push_back(rounded(time_s));
    out["x_n"].push_back(rounded(f.x()));
    out["y_n"].push_back(rounded(f.y()));
    out["z_n"].push_back(rounded(f.z()));
    out["total_n"].push_back(rounded(f.norm()));
    out["tip_x_mm"].push_back(rounded(tip.x()));
    out["tip_z_mm"].push_back(rounded(tip.z()));
    out["density_g_cm3"].push_back(rounded(tick.report.cutting.density_g_cm3));
  });
  out["removed_mm3"] = rounded(bench.replica().removed_mm3());
  out["completed"] = bench.session().done() && bench.session().surgeon().results()[0].completed;
  return out;
}

json profiles() {
  // Surface burring takes a layer off. Milling makes a slot as deep as the tool's radius, in passes.
  PlanStep surface;
  surface.action = Action::burr;
  surface.tool = "burr-round-5";
  surface.hand = HandKind::expert;
  surface.window_u_mm = 17, surface.window_v_mm = 12, surface.depth_mm = 0.5, surface.sweep_mm_per_s = 12;
  surface.tremor_mm = 0.1;
  surface.entry.point_mm = Vec3(0.1, -0.2, 0);
  surface.entry.axis = Vec3(0, 0, 1);
  PlanStep slot = surface;
  slot.window_u_mm = 14, slot.window_v_mm = 5, slot.depth_mm = 2.5, slot.sweep_mm_per_s = 5;
  return {{"burring", profile(surface)}, {"milling", profile(slot)}};
}

constexpr double kBore_mm = 3.5, kSleeve_mm = 30.0, kPlay_mm = 0.5 * (kBore_mm - 3.2);

Result<Tool> find_with_sleeve(std::string_view name) {
  if (name != "sleeve") return find_tool(name);
  Tool tool;
  tool.name = "sleeve";
  tool.title = "Sleeve";
  tool.kind = ToolKind::drill_sleeve;
  tool.diameter_mm = 8.0;
  tool.bore_mm = kBore_mm;
  tool.cutting_length_mm = kSleeve_mm;
  return tool;
}

double play_mm(double depth_mm) { return kPlay_mm * (1.0 + 2.0 * depth_mm / kSleeve_mm); }

// A trembling hand drills along a planned line, through a sleeve and by eye. Measures how far the tips of its cuts are
// from the line.
json guided() {
  PlanStep place;
  place.action = Action::place;
  place.tool = "sleeve";
  place.seconds = 0.1;
  place.entry.point_mm = Vec3(0.3, -0.2, 0);
  place.entry.axis = Vec3(0, 0, 1);
  const Case bone = block_case();
  json out{{"play_mm", kPlay_mm}, {"sleeve_mm", kSleeve_mm}};
  for (const bool through : {true, false})
    for (const HandKind hand : {HandKind::rig, HandKind::expert, HandKind::novice}) {
      PlanStep step = drill_step(hand);
      step.feed_mm_per_s = 2;
      step.tremor_mm = 1.2;
      step.through_guide = through;
      step.entry = through ? PlanEntry{} : place.entry;
      std::vector<PlanStep> plan{step};
      if (through) plan.insert(plan.begin(), place);
      Result<ReadyPlan> ready = make_ready(plan, bone, find_with_sleeve);
      if (!ready) continue;
      Bench bench(bone, *ready);
      double most = 0.0;
      bench.run([&](const SessionTick& tick) {
        const Vec3& tip = tick.report.pose_bone_proxy.position_mm;
        if (tick.order.phase != SurgeonPhase::feed && tick.order.phase != SurgeonPhase::push) return;
        if (tip.z() > 0.0)
          most = std::max(most, (tip - *place.entry.point_mm).head<2>().norm() / (play_mm(tip.z()) + kQuantum_mm));
      });
      json run{{"hand", hand == HandKind::rig      ? "rig"
                        : hand == HandKind::expert ? "expert"
                                                   : "novice"},
               {"guided", through}};
      double excess_mm = -1e9;
      for (const Cut& cut : bench.cuts()) {
        const Vec3 tip = dequantise(cut.path.back()).position_mm;
        if (tip.z() < 0.5 || tip.z() > 30.0) continue;
        const double off = (tip - *place.entry.point_mm).head<2>().norm();
        excess_mm = std::max(excess_mm, off - play_mm(tip.z()));
        run["depth_mm"].push_back(rounded(tip.z()));
        run["off_mm"].push_back(rounded(off));
      }
      run["most_of_play"] = rounded(most);
      run["cut_excess_mm"] = rounded(excess_mm);
      run["completed"] =
          bench.session().done() && std::ranges::all_of(bench.session().surgeon().results(), &StepResult::completed);
      out["runs"].push_back(run);
    }
  return out;
}

}  // namespace
}  // namespace osteon::haptic::test

int main(int argc, char** argv) {
  using namespace osteon::haptic::test;
  const std::pair<const char*, nlohmann::json (*)()> parts[] = {
      {"rig", rig}, {"hands", hands}, {"steps", steps}, {"profiles", profiles}, {"guided", guided}};
  for (const auto& [name, run] : parts)
    if (argc == 2 && std::strcmp(argv[1], name) == 0) {
      std::printf("%s\n", run().dump().c_str());
      return 0;
    }
  std::fprintf(stderr, "osteon-feel: needs one of rig, hands, steps, profiles, guided\n");
  return 1;
}
