#include "tests/fuzz/targets.hpp"

#include <cmath>

#include "common/core/check.hpp"
#include "common/wire/convert.hpp"

namespace osteon::fuzz {
namespace {

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

Cut a_cut() {
  const Tool drill = builtin_tools()[0];
  return {.author = {1}, .author_seq = 1, .lease_epoch = 1, .body = {}, .tool = drill.hash(), .level = 2,
          .path = {quantise(pose_along({0, 0, 1}, {0, 0, -1})), quantise(pose_along({0, 0, -1}, {0, 0.1, -1}))}, .spindle_rpm = 1000};
}

SceneItem an_item() {
  SceneItem item;
  item.tool = builtin_tools()[0].hash();
  item.pose_bone_item = pose_along({1, 2, 3}, {0, 0, -1});
  return item;
}

// What is accepted must come back the same when it is sent on.
template <class Message>
void parse_and_convert(std::span<const std::uint8_t> data) {
  Message message;
  if (!message.ParseFromArray(data.data(), static_cast<int>(data.size()))) return;
  const auto value = wire::from_wire(message);
  if (value) OSTEON_CHECK(wire::from_wire(wire::to_wire(*value)).has_value());
}

BlockPayload a_block() {
  std::vector<float> sphere;
  for (int x = 0; x < kBlockApron; ++x)
    for (int y = 0; y < kBlockApron; ++y)
      for (int z = 0; z < kBlockApron; ++z) sphere.push_back(static_cast<float>(std::hypot(x - 9, y - 9, z - 9) - 5.3));
  return encode_block(sphere, sphere, 0, 0.5);
}

void decode_any_block(std::span<const std::uint8_t> data) {
  const auto mesh = decode_block({}, {{data.begin(), data.end()}}, 0.5);
  if (!mesh) return;
  for (const auto& triangle : mesh->triangles)
    for (const std::uint32_t vertex : triangle) OSTEON_CHECK(vertex < mesh->positions_mm.size());
}

}  // namespace

std::vector<Target> targets() {
  FieldLeaf leaf{{}, 1, {8, -16, 0}, std::vector<std::int16_t>(kLeafVoxels, 7)};
  return {{"cut", parse_and_convert<v1::Cut>, {bytes_of(wire::to_wire(a_cut()).SerializeAsString())}},
          {"cutting_state", parse_and_convert<v1::CuttingState>, {bytes_of(wire::to_wire(CuttingState{}).SerializeAsString())}},
          {"field_leaf", parse_and_convert<v1::FieldLeaf>, {bytes_of(wire::to_wire(leaf).SerializeAsString())}},
          {"scene_item", parse_and_convert<v1::SceneItem>, {bytes_of(wire::to_wire(an_item()).SerializeAsString())}},
          {"tool_definition", parse_and_convert<v1::ToolDefinition>, {bytes_of(wire::to_wire(builtin_tools()[0]).SerializeAsString())}},
          {"mesh_block", decode_any_block, {a_block().bytes}}};
}

}  // namespace osteon::fuzz
