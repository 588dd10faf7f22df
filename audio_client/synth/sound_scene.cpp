#include "audio_client/synth/sound_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/tools/tool.hpp"

namespace osteon::audio {
namespace {

// Load 1 is the sum of two halves: from the thrust, and from the power at the spindle.
struct LoadScale {
  double thrust_N, power_W;
};
// The drill at Chi's cortical point: 29 N and 27 N mm at 1000 rpm. The burr: a firm hand's side load on cortical bone.
constexpr LoadScale kLoadScales[kHandpieceKinds] = {{29.0, 2.8}, {6.0, 6.0}};

constexpr double kCorticalDensity_g_cm3 = 1.9;
constexpr double kMaxForce_N = 1000.0, kMaxTorque_Nmm = 100'000.0, kMaxFeed_mm_per_s = 1000.0, kMaxDensity_g_cm3 = 4.0;
constexpr double kMaxCortex_mm = 100.0, kMaxImpulse_N_s = 100.0;

double within(double value, double high) { return std::isfinite(value) ? std::clamp(value, 0.0, high) : 0.0; }

// The name in the list of tools, which lives as long as the program.
std::string_view lasting_name(std::string_view name) {
  for (const Tool& tool : builtin_tools())
    if (tool.name == name) return tool.name;
  return {};
}

bool fed_along_axis(ToolKind kind) {
  return kind == ToolKind::drill || kind == ToolKind::end_drill || kind == ToolKind::sphere_reamer ||
         kind == ToolKind::cylinder_reamer || kind == ToolKind::outside_reamer || kind == ToolKind::pin ||
         kind == ToolKind::screw;
}

// Zero where a state does not know the rotation.
Vec3 axis_of(const Pose& pose) {
  const double norm = pose.rotation.norm();
  return std::abs(norm - 1.0) < 1e-3 ? pose.direction(Vec3::UnitZ()) : Vec3(Vec3::Zero());
}

}  // namespace

ToolSound tool_sound(const CuttingState& state) {
  const Result<Tool> tool = find_tool(state.tool_name);
  ToolSound sound;
  sound.author = state.author.value;
  sound.state_seq = state.state_seq;
  // A tool that this build does not know sounds like a drill.
  sound.handpiece =
      tool && tool->kind == ToolKind::round_burr ? HandpieceKind::direct_burr : HandpieceKind::geared_drill;
  sound.rpm = within(state.spindle_rpm, kMaxRpm);
  sound.suction = state.suction;
  sound.tool = lasting_name(state.tool_name);
  sound.cortex_mm = within(state.cortex_mm, kMaxCortex_mm);
  sound.seated = within(state.seated, 1.0);
  sound.blows = state.blows;
  sound.blow_impulse_N_s = within(state.blow_impulse_N_s, kMaxImpulse_N_s);
  sound.tip_mm = sound.stated_tip_mm = state.pose_bone_tool.position_mm;
  sound.depth_mm = state.depth_mm;
  sound.phase = state.phase;
  sound.time_ns = sound.stated_ns = state.time_ns;
  if (!tool || fed_along_axis(tool->kind)) sound.feed_axis = axis_of(state.pose_bone_tool);

  const bool contact = state.phase == CuttingPhase::cutting || state.phase == CuttingPhase::rubbing;
  if (!contact) return sound;
  const LoadScale& scale = kLoadScales[static_cast<int>(sound.handpiece)];
  const double power_W = std::abs(state.torque_Nmm) * 1e-3 * 2.0 * std::numbers::pi * sound.rpm / 60.0;
  sound.force_N = within(state.force_physical_N.norm(), kMaxForce_N);
  sound.torque_Nmm = within(std::abs(state.torque_Nmm), kMaxTorque_Nmm);
  sound.feed_mm_per_s = within(state.feed_mm_per_s, kMaxFeed_mm_per_s);
  sound.density_g_cm3 = within(state.density_g_cm3, kMaxDensity_g_cm3);
  sound.bone_g_cm3 = sound.density_g_cm3 * within(state.engaged_fraction, 1.0);
  sound.load = within(0.5 * state.force_physical_N.norm() / scale.thrust_N + 0.5 * power_W / scale.power_W, kMaxLoad);
  sound.hardness = within(state.density_g_cm3 / kCorticalDensity_g_cm3, kMaxHardness);
  sound.advancing = state.feed_mm_per_s > 0;
  if (state.phase == CuttingPhase::cutting) {
    // The removed mass determines the flow. Soft bone crumbles; hard bone breaks into audible chips.
    const double flow = within(state.feed_mm_per_s, 1000.0) * sound.hardness;
    sound.chips = std::min(kMaxChips, std::sqrt(flow) * std::pow(sound.hardness, 0.7));
  }
  return sound;
}

SoundScene sound_scene(std::span<const CuttingState> states, std::int64_t received_ns) {
  SoundScene scene;
  scene.received_ns = received_ns;
  for (const CuttingState& state : states.first(std::min<std::size_t>(states.size(), kMaxTools))) {
    scene.tools[static_cast<std::size_t>(scene.count++)] = tool_sound(state);
  }
  return scene;
}

}  // namespace osteon::audio
