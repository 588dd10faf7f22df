#include "tests/fuzz/samples.hpp"

#include "common/tools/tool.hpp"

namespace osteon::fuzz {

Cut a_cut() {
  const Tool drill = builtin_tools()[0];
  return {.author = {1},
          .author_seq = 1,
          .lease_epoch = 1,
          .body = {},
          .tool = drill.hash(),
          .level = 2,
          .path = {quantise(pose_along({0, 0, 1}, {0, 0, -1})), quantise(pose_along({0, 0, -1}, {0, 0.1, -1}))},
          .spindle_rpm = 1000};
}

SceneItem an_item() {
  SceneItem item;
  item.tool = builtin_tools()[0].hash();
  item.pose_bone_item = pose_along({1, 2, 3}, {0, 0, -1});
  return item;
}

Restrictions a_supervision() {
  return {.stopped = true,
          .taken_by = {2},
          .guide = {3},
          .guide_share = 500,
          .force_limit = 300,
          .zone = ZoneLimit{{1, 2, 3}, 1000},
          .tools = {builtin_tools()[0].hash()},
          .words = "wait"};
}

Annotation an_annotation() {
  return {.id = 1,
          .author = {2},
          .kind = AnnotationKind::line,
          .points = {{1, 2, 3}, {4, 5, 6}},
          .words = "here",
          .colour = 0x00ff00};
}

CuttingState a_state() {
  CuttingState state;
  state.author = {4};
  state.state_seq = 3;
  state.tool_name = "drill";
  state.pose_bone_device.position_mm.z() = -0.5;
  state.time_ns = 5'000'000'000;
  state.cortex_mm = 4.5;
  state.seated = 0.5;
  state.blows = 3;
  state.blow_impulse_N_s = 2.8;
  return state;
}

ViewFrustum a_look() { return {{1, 2, 3}, {4, 5, 6}, 0.001, 0.3}; }

}  // namespace osteon::fuzz
