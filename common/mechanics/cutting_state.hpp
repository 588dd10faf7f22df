// What a tool does to the bone, as the haptic client computes it. It drives sound, gauges and the drawn tool.
#pragma once
#include <cstdint>
#include <string>

#include "common/core/id.hpp"
#include "common/geometry/pose.hpp"

namespace osteon {

enum class CuttingPhase : std::uint8_t { idle = 1, free = 2, cutting = 3, rubbing = 4 };

// No clock that began with its machine is later: 146 years. So times can be added and subtracted.
inline constexpr std::int64_t kLatestState_ns = std::int64_t{1} << 62;

struct CuttingState {
  AuthorId author;
  std::uint64_t state_seq = 0;
  Pose pose_bone_tool;    // the proxy
  Pose pose_bone_device;  // the user's hand
  std::string tool_name;  // empty: the hand holds no tool
  double spindle_rpm = 0;
  double feed_mm_per_s = 0;
  double density_g_cm3 = 0;              // engaged-area weighted
  double engaged_fraction = 0;           // 0 to 1
  Vec3 force_physical_N = Vec3::Zero();  // of the bone on the tool, bone frame
  double torque_Nmm = 0;
  double depth_mm = 0;  // of the tip from the entry of the step under way, along the axis of its site;
                        // negative before the bone, 0 before the first step
  CuttingPhase phase = CuttingPhase::idle;
  double force_hand_N = 0;    // of the device on the user's hand; 0: also where the device shows no force
  double device_holds_N = 0;  // the most that the device holds for long; 0: it shows no force, or nothing is known
  bool on_metal = false;      // the spindle turns, but metal is in the way: the tool cuts nothing
  bool irrigation = false, suction = false;  // by the user's other hand
  double flutes_full = 0;                    // share of the tool's flutes that chips fill, 0 to 1
  std::int64_t time_ns = 0;                  // when the tool was here, by the haptic client's steady clock; 0: unknown
  double cortex_mm = 0;     // thickness of the cortical layer that the tool cuts, along its feed; 0: none, or unknown
  double seated = 0;        // of a broach, 0 to 1: how little the next blow would drive it
  std::uint32_t blows = 0;  // of mallet or handpiece on this tool so far
  double blow_impulse_N_s = 0;  // of the newest blow
};

}  // namespace osteon
