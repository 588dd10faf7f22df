// What is audible now: every tool in the room as numbers, ready to be passed to the sound card's thread.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "audio_client/synth/handpiece.hpp"
#include "common/mechanics/cutting_state.hpp"

namespace osteon::audio {

struct ToolSound {
  std::uint64_t author = 0;
  std::uint64_t state_seq = 0;
  HandpieceKind handpiece = HandpieceKind::geared_drill;
  double rpm = 0;
  double load = 0;           // 0 free; 1 at the cortical reference point of the hand piece; at most 1.5
  double load_ahead = 0;     // of the load, what no state has said yet: it was computed ahead
  double hardness = 0;       // density under the cutting part / 1.9 g/cm^3, 0 without contact
  double chips = 0;          // chip flow, 0 without cutting; 1 at 1 mm/s through cortical bone; at most 1.5
  bool advancing = false;    // moves into the bone
  bool suction = false;      // the user's other hand holds the sucker
  std::string_view tool;     // name of the definition; static, or owned by the presets; empty for a tool unknown here
  double force_N = 0;        // of the bone on the tool
  double torque_Nmm = 0;     // of the bone on the spindle
  double feed_mm_per_s = 0;  // into the bone
  double density_g_cm3 = 0;  // under the cutting part, 0 without contact
  double cortex_mm = 0;      // thickness of the cortical layer, 0 if unknown
  double seated = 0;         // of a broach, 0 to 1
  std::uint32_t blows = 0;   // so far
  double blow_impulse_N_s = 0;
  Vec3 tip_mm = Vec3::Zero();  // of the tool, bone frame
  double depth_mm = 0;         // of the tip from its entry
  // As the newest state has them, and not computed ahead: the tip, the state's time or 0, and the density under the
  // cutting part times the share of it that is in bone.
  Vec3 stated_tip_mm = Vec3::Zero();
  std::int64_t stated_ns = 0;
  double bone_g_cm3 = 0;
  // Out of the tip, bone frame. Zero for a tool that is not fed along its axis, and where the axis is not known.
  Vec3 feed_axis = Vec3::Zero();
  CuttingPhase phase = CuttingPhase::idle;
  std::int64_t time_ns = 0;  // of the state, by the clock of the tool's haptic client; 0: unknown
};

// Limits of the numbers above. Whoever computes ahead stays within them.
inline constexpr double kMaxRpm = 120'000.0, kMaxLoad = 1.5, kMaxHardness = 1.2, kMaxChips = 1.5;

inline constexpr int kMaxTools = 8;

struct SoundScene {
  std::array<ToolSound, kMaxTools> tools{};
  int count = 0;
  std::int64_t received_ns = 0;  // steady clock
};

[[nodiscard]] ToolSound tool_sound(const CuttingState& state);

// Takes the first kMaxTools states; further tools are silent.
[[nodiscard]] SoundScene sound_scene(std::span<const CuttingState> states, std::int64_t received_ns);

}  // namespace osteon::audio
