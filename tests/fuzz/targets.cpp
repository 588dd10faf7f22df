#include "tests/fuzz/targets.hpp"

#include <array>
#include <cmath>
#include <random>

#include "common/core/check.hpp"
#include "common/wire/convert.hpp"
#include "tests/fuzz/datagram_target.hpp"

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

// Coarser surroundings on several sides and corners; rough, so that rows of solid bits are coded in each of their ways.
BlockPayload a_seamed_block() {
  BlockSamples block;
  block.key = {{}, 2, {}};
  block.level_pitch_mm = 0.125;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> rough(-1.5f, 1.5f);
  const auto fill = [&](const CoordBox& box, float scale, bool is_rough, std::vector<float>& out) {
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const float to_surface = static_cast<float>(std::hypot(x * scale - 8, y * scale - 8, z * scale - 8)) - 9.3f;
          out.push_back(is_rough && x > 4 && x < 9 ? to_surface + rough(random) : to_surface);
        }
  };
  fill(block_samples(block.key), 1.0f, true, block.solid_mm);
  block.surface_mm = block.solid_mm;
  for (std::size_t i = 0; i < block.surface_mm.size(); i += 3) block.surface_mm[i] -= 0.4f;  // some of it is cut
  for (const std::size_t y : {1, 2})
    for (const std::size_t z : {1, 2}) {
      block.seams.coarser[y * 4 + z] = 1;
      block.seams.coarser[(3 * 4 + y) * 4 + z] = 4;
      block.seams.coarser[(y * 4 + 3) * 4 + z] = 2;
    }
  block.seams.coarser[3] = block.seams.coarser[63] = 3;  // beyond an edge and a corner
  for (int steps = 1; steps <= kSeamSteps; ++steps)
    fill(coarse_samples(block.key, steps), static_cast<float>(1 << steps), false,
         block.coarse_mm[static_cast<std::size_t>(steps - 1)]);
  const BlockPayload payload = encode_block(block);
  OSTEON_CHECK(!payload.bytes.empty() && decode_block(block.key, payload, block.level_pitch_mm).has_value());
  return payload;
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
          {"look",
           parse_and_convert<v1::Look>,
           {bytes_of(wire::to_wire(Look{{1, 2, 3}, {4, 5, 6}, 0.001, 0.3}).SerializeAsString())}},
          datagram_target(),
          {"mesh_block", decode_any_block, {a_block().bytes, a_seamed_block().bytes}}};
}

}  // namespace osteon::fuzz
