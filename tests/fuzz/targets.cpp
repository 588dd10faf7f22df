#include "tests/fuzz/targets.hpp"

#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

#include "common/core/check.hpp"
#include "common/wire/client_link.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/server_link.hpp"
#include "tests/fuzz/calls_messages.hpp"
#include "tests/fuzz/calls_target.hpp"
#include "tests/fuzz/datagram_target.hpp"
#include "tests/fuzz/field_target.hpp"
#include "tests/fuzz/import_targets.hpp"
#include "tests/fuzz/journal_target.hpp"
#include "tests/fuzz/pointer_target.hpp"
#include "tests/fuzz/requests_target.hpp"
#include "tests/fuzz/samples.hpp"
#include "tests/fuzz/sound_targets.hpp"
#include "tests/fuzz/ticket_target.hpp"
#include "tests/fuzz/upload_target.hpp"

namespace osteon::fuzz {
namespace {

using namespace std::chrono_literals;

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

// An accepted message must come back the same when it is sent on.
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

// A block with coarser neighbours on several sides and corners. It is rough, so that rows of solid bits use each of
// their codings.
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

// Keys of the fast path. Whatever a peer with the key sends must neither stop the other end nor make it grow.
SessionKeys link_keys() {
  return make_session_keys(3, [](std::span<std::uint8_t> bytes) { std::ranges::fill(bytes, std::uint8_t{0x3c}); });
}

wire::ServerLink server_end() {
  return {link_keys(), {1}, [](std::span<std::uint8_t> bytes) { std::ranges::fill(bytes, std::uint8_t{0x7e}); }};
}

// Counts the packets that an end received with the key: those it could read, and those that a correct peer would not
// send.
struct PacketCounts {
  std::uint64_t taken = 0, refused = 0;
  void add(const wire::LinkCounts& counts) { ++(counts.malformed == 0 ? taken : refused); }
};
PacketCounts up_packets, down_packets;

void as_up_packet(std::span<const std::uint8_t> plain) {
  static const Cut first = a_cut();
  wire::ServerLink link = server_end();
  Cut cut = first;
  for (; cut.author_seq <= 3; ++cut.author_seq)
    OSTEON_CHECK(link.push({cut.author_seq, {.room_seq = {9}, .kind = wire::SessionEntryKind::committed, .cut = cut}}));
  Sealer sealer(link_keys().session, link_keys().up);
  DatagramBuffer buffer;
  const Endpoint client{0, 1, 1};
  for (auto now = 1000ms; now < 1020ms; now += 5ms) {
    link.receive(client, sealer.seal(plain, now, buffer), now);
    while (const auto out = link.send(now, buffer))
      OSTEON_CHECK(out->to == client && out->bytes.size() <= kMostDatagramBytes);
    while (const auto taken = link.take_cut()) OSTEON_CHECK(wire::fits_a_packet(*taken));
    (void)link.take_state();
  }
  OSTEON_CHECK(link.acknowledged() <= 3);
  up_packets.add(link.half().counts());
}

void as_down_packet(std::span<const std::uint8_t> plain) {
  static const Cut first = a_cut();
  wire::ClientLink link(link_keys());
  OSTEON_CHECK(link.push(first));
  Sealer sealer(link_keys().session, link_keys().down);
  DatagramBuffer buffer;
  for (auto now = 1000ms; now < 1040ms; now += 10ms) {
    link.receive(sealer.seal(plain, now, buffer), now);
    OSTEON_CHECK(link.send(now, buffer).size() <= kMostDatagramBytes);
    while (const auto entry = link.take_entry()) OSTEON_CHECK(wire::fits_a_packet(entry->entry.cut));
    OSTEON_CHECK(link.partners(now).size() <= wire::ClientLink::kMostPartners);
  }
  OSTEON_CHECK(link.acknowledged() <= 1);
  down_packets.add(link.half().counts());
}

// Packets as the two ends make them, with all fields set.
Bytes an_up_packet() {
  SendWindow window;
  const wire::ToolNumbers tools;
  wire::CutSender sender(window, tools);
  OSTEON_CHECK(sender.push(a_cut()));
  v1::UpPacket packet;
  packet.set_acknowledged_beyond(5);
  packet.mutable_times()->set_sent_us(1'000'000);
  packet.set_path_echo(std::string(16, '\x7e'));
  *packet.mutable_state() = wire::to_tool_state(a_state(), 1, true);
  packet.add_cuts()->ParseFromString(window.item(1).head);
  packet.mutable_cuts(0)->set_cuts(window.item(1).bytes);
  return bytes_of(packet.SerializeAsString());
}

Bytes a_down_packet() {
  SendWindow window;
  const wire::ToolNumbers tools;
  wire::EntrySender sender(window, tools);
  OSTEON_CHECK(sender.push({.room_seq = {1}, .kind = wire::SessionEntryKind::committed, .cut = a_cut()}));
  OSTEON_CHECK(sender.push({.room_seq = {2}, .kind = wire::SessionEntryKind::rejected, .author_seq = 2, .reason = 1}));
  OSTEON_CHECK(sender.push(
      {.room_seq = {3}, .kind = wire::SessionEntryKind::supervised, .lease_epoch = 4, .supervision = a_supervision()}));
  v1::DownPacket packet;
  OSTEON_CHECK(packet.ParseFromString(window.item(2).bytes + window.item(3).bytes));  // parts merge
  packet.mutable_times()->set_sent_us(1'000'000);
  packet.set_lease_epoch(1);
  *packet.add_partners() = wire::to_tool_state(a_state(), 1, true);
  packet.add_entries()->ParseFromString(window.item(1).head);
  packet.mutable_entries(0)->set_entries(window.item(1).bytes);
  return bytes_of(packet.SerializeAsString());
}

// Changes one field at a random depth of the packet, or one bit of bytes that are not a packet. Datagrams are changed
// the same way.
template <class Packet>
void change_packet(Bytes& input, std::mt19937& random) {
  Packet packet;
  if (input.empty()) return;
  if (packet.ParseFromArray(input.data(), static_cast<int>(input.size()))) {
    change_message(packet, random);
    input = bytes_of(packet.SerializeAsString());
  } else {
    input[random() % input.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
  }
}

template <class Packet>
Target packet_target(std::string name, PlainTarget end, Bytes packet, const PacketCounts& counts) {
  Target target = datagram_target(std::move(end), {packet});
  target.name = std::move(name);
  target.rounds = [packet = std::move(packet)](const Bytes& seed) { return seed == packet ? 1 : 6; };
  target.change = change_packet<Packet>;
  target.figures = [&counts] {
    return "packets taken " + std::to_string(counts.taken) + ", refused " + std::to_string(counts.refused);
  };
  return target;
}

}  // namespace

std::vector<Target> targets() {
  google::protobuf::SetLogHandler(nullptr);  // it logs a line for every text that is not UTF-8
  FieldLeaf leaf{{}, 1, {8, -16, 0}, std::vector<std::int16_t>(kLeafVoxels, 7)};
  return {
      {"cut", parse_and_convert<v1::Cut>, {bytes_of(wire::to_wire(a_cut()).SerializeAsString())}},
      {"cutting_state",
       parse_and_convert<v1::CuttingState>,
       {bytes_of(wire::to_wire(CuttingState{}).SerializeAsString())}},
      {"field_leaf", parse_and_convert<v1::FieldLeaf>, {bytes_of(wire::to_wire(leaf).SerializeAsString())}},
      {"scene_item", parse_and_convert<v1::SceneItem>, {bytes_of(wire::to_wire(an_item()).SerializeAsString())}},
      {"tool_definition",
       parse_and_convert<v1::ToolDefinition>,
       {bytes_of(wire::to_wire(builtin_tools()[0]).SerializeAsString())}},
      {"look", parse_and_convert<v1::ViewFrustum>, {bytes_of(wire::to_wire(a_look()).SerializeAsString())}},
      packet_target<v1::UpPacket>("up_packet", as_up_packet, an_up_packet(), up_packets),
      packet_target<v1::DownPacket>("down_packet", as_down_packet, a_down_packet(), down_packets),
      {"mesh_block", decode_any_block, {a_block().bytes, a_seamed_block().bytes}},
      ticket_target(),
      ticket_contents_target(),
      access_list_target(),
      entries_target(),
      evaluated_entries_target(),
      genesis_target(),
      journal_file_target(),
      {"supervision",
       parse_and_convert<v1::Restrictions>,
       {bytes_of(wire::to_wire(a_supervision()).SerializeAsString())}},
      {"annotation", parse_and_convert<v1::Annotation>, {bytes_of(wire::to_wire(an_annotation()).SerializeAsString())}},
      requests_target(),
      calls_target(),
      field_messages_target(),
      upload_target(),
      mesh_target(),
      tool_file_target(),
      carve_script_target(),
      legend_target(),
      edits_target(),
      landmarks_target(),
      sub_volume_target(),
      sub_volume_meta_target(),
      case_info_target(),
      bone_volume_target(),
      scan_volume_target(),
      cut_fields_target(),
      dicom_target(),
      inv3_target(),
      scan_archive_target(),
      label_slice_target(),
      raw_volume_target(),
      grey_slice_target(),
      label_names_target(),
      label_header_target(),
      dicom_segments_target(),
      pointer_message_target(),
      sound_message_target(),
      wav_file_target(),
      sound_model_target(),
      session_log_target(),
      preset_target(),
      head_target()};
}

}  // namespace osteon::fuzz
