#include "tests/unit/audio_client/scripted_drilling.hpp"

#include <algorithm>
#include <array>
#include <span>

namespace osteon::test {
namespace {

CuttingState drill(double rpm, CuttingPhase phase) {
  CuttingState state;
  state.author = AuthorId{1};
  state.tool_name = "drill-3.2";
  state.pose_bone_tool = pose_along(Vec3::Zero(), -Vec3::UnitZ());
  state.spindle_rpm = rpm;
  state.phase = phase;
  return state;
}

double mix(double a, double b, double t) { return a + (b - a) * t; }

// Mixes every number of `a` and `b`, as when a layer's edge passes the drill's cone.
CuttingState between(const CuttingState& a, const CuttingState& b, double t) {
  CuttingState state = t < 1 ? (a.phase == CuttingPhase::cutting ? a : b) : b;
  state.spindle_rpm = mix(a.spindle_rpm, b.spindle_rpm, t);
  state.feed_mm_per_s = mix(a.feed_mm_per_s, b.feed_mm_per_s, t);
  state.density_g_cm3 = mix(a.density_g_cm3, b.density_g_cm3, t);
  state.engaged_fraction = mix(a.engaged_fraction, b.engaged_fraction, t);
  state.force_physical_N = a.force_physical_N + (b.force_physical_N - a.force_physical_N) * t;
  state.torque_Nmm = mix(a.torque_Nmm, b.torque_Nmm, t);
  return state;
}

}  // namespace

CuttingState idle_drill() { return drill(0, CuttingPhase::idle); }

CuttingState free_drill(double rpm) { return drill(rpm, CuttingPhase::free); }

CuttingState cortical_drill(double rpm) {
  CuttingState state = drill(rpm, CuttingPhase::cutting);
  state.feed_mm_per_s = 0.89;
  state.density_g_cm3 = 1.9;
  state.engaged_fraction = 1;
  state.force_physical_N = Vec3(0, 0, 27);
  state.torque_Nmm = 25;
  return state;
}

CuttingState cancellous_drill(double rpm) {
  CuttingState state = drill(rpm, CuttingPhase::cutting);
  state.feed_mm_per_s = 10.7;
  state.density_g_cm3 = 0.3;
  state.engaged_fraction = 1;
  state.force_physical_N = Vec3(0, 0, 11);
  state.torque_Nmm = 10;
  return state;
}

ScriptedDrilling scripted_drilling() {
  // The speed droops under load by a twentieth, the most that the dissertation's motor shows.
  const CuttingState off = idle_drill(), free = free_drill(1400), cortical = cortical_drill(1345),
                     cancellous = cancellous_drill(1380);
  CuttingState plunge =
      cortical;  // the far cortex gives way: no force, and the hand goes on with the last of the point
  plunge.feed_mm_per_s = 60;
  plunge.force_physical_N = Vec3(0, 0, 0.5);
  plunge.torque_Nmm = 0.5;
  plunge.density_g_cm3 = 0.4;
  plunge.engaged_fraction = 0.02;
  plunge.spindle_rpm = 1400;

  struct Step {
    const char* name;
    CuttingState state;
    double change_s, hold_s;
  };
  const std::array<Step, 8> steps = {{{"off", off, 0, 0.5},
                                      {"free", free, 0.008, 2.0},
                                      {"cortical", cortical, 0.3, 3.2},
                                      {"cancellous", cancellous, 0.1, 2.4},
                                      {"far cortical", cortical, 0.2, 2.8},
                                      {"breakthrough", plunge, 0.04, 0.05},
                                      {"free again", free, 0.02, 1.8},
                                      {"off again", off, 0.008, 1.574}}};
  ScriptedDrilling script;
  CuttingState last = off;
  const auto now_s = [&] { return static_cast<double>(script.states.size()) / 120.0; };
  for (const Step& step : steps) {
    const int change = std::max(1, static_cast<int>(step.change_s * 120.0)),
              hold = static_cast<int>(step.hold_s * 120.0);
    for (int i = 1; i <= change; ++i)
      script.states.push_back(between(last, step.state, static_cast<double>(i) / change));
    const double from_s = now_s();
    for (int i = 0; i < hold; ++i) script.states.push_back(step.state);
    script.parts.push_back({step.name, from_s, now_s()});
    last = step.state;
  }
  std::uint64_t seq = 0;
  for (CuttingState& state : script.states) state.state_seq = ++seq;
  return script;
}

std::vector<float> play(audio::DrillSynth& synth, const std::vector<CuttingState>& states) {
  std::vector<float> samples(states.size() * kFramesPerState);
  for (std::size_t i = 0; i < states.size(); ++i) {
    synth.aim(audio::sound_scene(std::span(&states[i], 1), 0));
    synth.process(std::span(samples).subspan(i * kFramesPerState, kFramesPerState));
  }
  return samples;
}

std::vector<float> play(audio::DrillSynth& synth, const CuttingState& state, double seconds) {
  return play(synth, std::vector<CuttingState>(static_cast<std::size_t>(seconds * 120.0), state));
}

}  // namespace osteon::test
