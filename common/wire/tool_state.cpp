#include "common/wire/tool_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/field/cut.hpp"

namespace osteon::wire {
namespace {

constexpr std::size_t kMostNameBytes = 64;
constexpr std::int64_t kMicrosecond_ns = 1000;
constexpr auto kLatest_us = static_cast<std::uint64_t>(kLatestState_ns / kMicrosecond_ns);

// Whole steps, clamped to the type's range. 0 for NaN.
template <class Integer>
Integer steps(double value, double per_unit) {
  if (std::isnan(value)) return 0;
  using Limits = std::numeric_limits<Integer>;
  constexpr auto kLeast = static_cast<double>(Limits::min()), kMost = static_cast<double>(Limits::max());
  return static_cast<Integer>(std::clamp(std::round(value * per_unit), kLeast, kMost));
}

void set_pose(v1::QuantisedPose& out, const Pose& pose) {
  const QuantisedPose quantised = quantise(pose);
  for (const std::int32_t p : quantised.position) out.add_position(p);
  for (const std::int16_t r : quantised.rotation) out.add_rotation(r);
}

Result<Pose> pose_from(const v1::QuantisedPose& pose, const std::string& field) {
  if (pose.position_size() != 3 || pose.rotation_size() != 4)
    return bad_field(field, "needs 3 positions and 4 rotations");
  QuantisedPose out;
  double norm = 0.0;
  for (int i = 0; i < 3; ++i) out.position[static_cast<std::size_t>(i)] = pose.position(i);
  for (int i = 0; i < 4; ++i) {
    const std::int32_t r = pose.rotation(i);
    if (r != static_cast<std::int16_t>(r)) return bad_field(field, "has a rotation beyond 16 bits");
    out.rotation[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(r);
    norm += static_cast<double>(r) * r;
  }
  if (std::abs(std::sqrt(norm) / 32767.0 - 1.0) > 1e-3)
    return bad_field(field, "has a rotation that is not a unit quaternion");
  return dequantise(out);
}

}  // namespace

v1::ToolState to_tool_state(const CuttingState& state, std::uint32_t buttons, bool with_effort) {
  v1::ToolState out;
  out.set_author(state.author.value);
  out.set_state_seq(state.state_seq);
  set_pose(*out.mutable_pose_bone_tool(), state.pose_bone_tool);
  if (quantise(state.pose_bone_device) != quantise(state.pose_bone_tool))
    set_pose(*out.mutable_pose_bone_device(), state.pose_bone_device);
  out.set_buttons(buttons);
  out.set_spindle_rpm(steps<std::uint32_t>(state.spindle_rpm, 1.0));
  out.set_phase(static_cast<v1::CuttingPhase>(state.phase));
  out.set_on_metal(state.on_metal);
  out.set_irrigation(state.irrigation);
  out.set_suction(state.suction);
  out.set_time_us(static_cast<std::uint64_t>(std::max<std::int64_t>(0, state.time_ns) / kMicrosecond_ns));
  out.set_blows(state.blows);
  if (!with_effort) return out;
  v1::ToolEffort& effort = *out.mutable_effort();
  effort.set_tool_name(state.tool_name.substr(0, kMostNameBytes));
  for (int i = 0; i < 3; ++i) effort.add_force(steps<std::int32_t>(state.force_physical_N[i], 1000.0));
  effort.set_torque(steps<std::int32_t>(state.torque_Nmm, 100.0));
  effort.set_feed(steps<std::uint32_t>(state.feed_mm_per_s, 1000.0));
  effort.set_density(steps<std::uint32_t>(state.density_g_cm3, 1000.0));
  effort.set_engaged(steps<std::uint32_t>(std::clamp(state.engaged_fraction, 0.0, 1.0), 1000.0));
  effort.set_depth(steps<std::int32_t>(state.depth_mm, 1024.0));
  effort.set_force_hand(steps<std::uint32_t>(state.force_hand_N, 1000.0));
  effort.set_device_holds(steps<std::uint32_t>(state.device_holds_N, 1000.0));
  effort.set_flutes_full(steps<std::uint32_t>(std::clamp(state.flutes_full, 0.0, 1.0), 1000.0));
  effort.set_cortex(steps<std::uint32_t>(state.cortex_mm, 100.0));
  effort.set_seated(steps<std::uint32_t>(std::clamp(state.seated, 0.0, 1.0), 1000.0));
  effort.set_blow_impulse(steps<std::uint32_t>(state.blow_impulse_N_s, 1000.0));
  return out;
}

Result<bool> take_over(const v1::ToolState& sent, KnownToolState& known) {
  if (sent.state_seq() <= known.state.state_seq) return false;
  CuttingState next = known.state;
  next.author = {sent.author()};
  next.state_seq = sent.state_seq();
  const auto tool = pose_from(sent.pose_bone_tool(), "pose_bone_tool");
  if (!tool) return tl::unexpected(tool.error());
  next.pose_bone_tool = next.pose_bone_device = *tool;
  if (sent.has_pose_bone_device()) {
    const auto device = pose_from(sent.pose_bone_device(), "pose_bone_device");
    if (!device) return tl::unexpected(device.error());
    next.pose_bone_device = *device;
  }
  next.spindle_rpm = sent.spindle_rpm();
  if (sent.phase() < v1::CUTTING_PHASE_IDLE || sent.phase() > v1::CUTTING_PHASE_RUBBING)
    return bad_field("phase", "is not one that this program knows");
  next.phase = static_cast<CuttingPhase>(sent.phase());
  next.on_metal = sent.on_metal();
  next.irrigation = sent.irrigation();
  next.suction = sent.suction();
  if (sent.time_us() > kLatest_us) return bad_field("time_us", "is later than any clock");
  next.time_ns = static_cast<std::int64_t>(sent.time_us()) * kMicrosecond_ns;
  next.blows = sent.blows();
  if (sent.has_effort()) {
    const v1::ToolEffort& effort = sent.effort();
    if (effort.force_size() != 3)
      return bad_field("effort.force", "needs 3 numbers, this has " + std::to_string(effort.force_size()));
    if (effort.engaged() > 1000) return bad_field("effort.engaged", "must be at most 1000");
    if (effort.flutes_full() > 1000) return bad_field("effort.flutes_full", "must be at most 1000");
    if (effort.seated() > 1000) return bad_field("effort.seated", "must be at most 1000");
    if (effort.tool_name().size() > kMostNameBytes) return bad_field("effort.tool_name", "is longer than 64 bytes");
    next.tool_name = effort.tool_name();
    for (int i = 0; i < 3; ++i) next.force_physical_N[i] = effort.force(i) / 1000.0;
    next.torque_Nmm = effort.torque() / 100.0;
    next.feed_mm_per_s = effort.feed() / 1000.0;
    next.density_g_cm3 = effort.density() / 1000.0;
    next.engaged_fraction = effort.engaged() / 1000.0;
    next.depth_mm = effort.depth() / 1024.0;
    next.force_hand_N = effort.force_hand() / 1000.0;
    next.device_holds_N = effort.device_holds() / 1000.0;
    next.flutes_full = effort.flutes_full() / 1000.0;
    next.cortex_mm = effort.cortex() / 100.0;
    next.seated = effort.seated() / 1000.0;
    next.blow_impulse_N_s = effort.blow_impulse() / 1000.0;
  }
  known = {next, sent.buttons()};
  return true;
}

}  // namespace osteon::wire
