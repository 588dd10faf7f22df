// The programs' own code against the vectors of vectors.json, which the client in Python checks too. A server gave most
// of them; the ones of noise are confirmed only here. Whoever changes the protocol by accident fails here.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/digest.hpp"
#include "common/link/sealed.hpp"
#include "common/surface/mesh_block.hpp"
#include "common/tools/tool_file.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/cut_run.hpp"
#include "common/wire/tool_state.hpp"
#include "server/journal/chain.hpp"
#include "server/journal/signing.hpp"

namespace osteon::test {
namespace {

using Json = nlohmann::json;

// A value as it was before its long texts were split into lines.
Json joined(const Json& value) {
  if (value.is_array()) {
    Json out = Json::array();
    for (const Json& one : value) out.push_back(joined(one));
    return out;
  }
  if (!value.is_object()) return value;
  const bool is_text = value.size() == 1 && value.contains("text"),
             is_lines = value.size() == 1 && value.contains("lines");
  if (is_text || is_lines) {
    std::string out;
    for (const Json& part : value.front()) out += part.get<std::string>() + (is_lines ? "\n" : "");
    return out;
  }
  Json out = Json::object();
  for (const auto& [name, one] : value.items()) out[name] = joined(one);
  return out;
}

std::string from_hex(const Json& hex) {
  const auto text = hex.get<std::string>();
  std::string bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

std::string to_hex(std::string_view bytes) {
  std::ostringstream hex;
  for (const char byte : bytes) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    const std::size_t value = static_cast<unsigned char>(byte);
    hex << kDigits[value >> 4] << kDigits[value & 15];
  }
  return hex.str();
}

template <class Bytes>
Bytes bytes_of(const Json& hex) {
  Bytes out;
  const std::string bytes = from_hex(hex);
  EXPECT_EQ(bytes.size(), out.bytes.size());
  std::memcpy(out.bytes.data(), bytes.data(), std::min(bytes.size(), out.bytes.size()));
  return out;
}

Digest sha256(std::string_view bytes) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(bytes)));
  return hasher.finish();
}

// "body level x y z"
BlockKey key_of(const std::string& text) {
  std::istringstream in(text);
  BlockKey key;
  in >> key.body.value >> key.level >> key.index.x >> key.index.y >> key.index.z;
  return key;
}

Json tool_hash(const Json& given) {
  const Result<Tool> tool = parse_tool(given["yaml"].get<std::string>(), "vector");
  return tool ? to_hex(tool->hash()) : tool.error().message;
}

Json surface_hash(const Json& given) {
  std::map<BlockKey, Digest> hashes;
  for (const auto& [key, digest] : given["blocks"].items()) hashes[key_of(key)] = bytes_of<Digest>(digest);
  return to_hex(osteon::surface_hash(hashes));
}

// As make_vectors.py hashes triangles: each from its smallest corner on, sorted, as nine floats of 32 bits.
Json block(const Json& given) {
  static_assert(std::endian::native == std::endian::little);
  const std::string bytes = from_hex(given["payload"]);
  const BlockPayload payload{{bytes.begin(), bytes.end()}};
  const Json& at = given["index"];
  const BlockKey key{.body = {}, .level = 0, .index = {at[0].get<int>(), at[1].get<int>(), at[2].get<int>()}};
  const Result<Mesh> mesh = decode_block(key, payload, given["level_pitch_mm"].get<double>());
  if (!mesh) return mesh.error().message;
  using Corner = std::array<float, 3>;
  std::vector<std::array<Corner, 3>> triangles;
  for (const auto& [a, b, c] : mesh->triangles) {
    std::array<Corner, 3> triangle{mesh->positions_mm[a], mesh->positions_mm[b], mesh->positions_mm[c]};
    std::ranges::rotate(triangle, std::ranges::min_element(triangle));
    triangles.push_back(triangle);
  }
  std::ranges::sort(triangles);
  const std::string_view raw(reinterpret_cast<const char*>(triangles.data()), triangles.size() * 36);
  std::string normals, cut, tissue;
  for (std::size_t v = 0; v < mesh->positions_mm.size(); ++v) {
    for (const float n : mesh->normals[v]) normals.push_back(static_cast<char>(std::nearbyint(20.0 * n)));
    cut.push_back(static_cast<char>(mesh->cut_face[v]));
    const Tissue kind = mesh->tissue.empty() ? Tissue::none : mesh->tissue[v];
    tissue.push_back(kind == Tissue::metal ? '\1' : kind == Tissue::enamel ? '\2' : '\0');
  }
  return {{"mesh_hash", to_hex(mesh_hash(payload))},
          {"triangles", to_hex(sha256(raw))},
          {"normals", to_hex(sha256(normals))},
          {"cut", to_hex(sha256(cut))},
          {"tissue", to_hex(sha256(tissue))}};
}

Json next_entry(const Json& given) {
  const auto seq = given["seq"].get<std::uint64_t>();
  const JournalHead before = given.contains("genesis") ? first_head(from_hex(given["genesis"]))
                                                       : JournalHead{{seq - 1}, bytes_of<Digest>(given["chain"])};
  const JournalEntry entry{{seq}, given["at_ns"].get<std::int64_t>(), from_hex(given["entry"])};
  return to_hex(next_head(before, entry).chain);
}

Json signed_entries(const Json& given) {
  const SignedEntries entries{{given["since"].get<std::uint64_t>()},
                              {{given["seq"].get<std::uint64_t>()}, bytes_of<Digest>(given["chain"])},
                              bytes_of<PublicKey>(given["public_key"]),
                              bytes_of<Signature>(given["signature"])};
  return fits(entries) ? "signed" : "not signed";
}

Json signed_register(const Json& given) {
  Hasher entry;
  entry.text("register");
  entry.text(from_hex(given["name"]));
  entry.text(from_hex(given["value"]));
  const auto seal = check_seal(from_hex(given["public_key"]) + from_hex(given["signature"]), entry.finish(),
                               first_head(from_hex(given["genesis"])).chain);
  return seal && seal->key == bytes_of<PublicKey>(given["public_key"]) ? "signed" : "not signed";
}

Json datagram(const Json& given) {
  const std::string bytes = from_hex(given["datagram"]);
  const std::span sealed(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  Opener opener(session_of(sealed).value_or(0), bytes_of<SealKey>(given["key"]));
  DatagramBuffer into;
  const auto opened = opener.open(sealed, std::chrono::seconds(1), into);
  v1::DownPacket packet;
  if (!opened || !packet.ParseFromArray(opened->plain.data(), static_cast<int>(opened->plain.size())))
    return "not opened";
  wire::ToolNumbers tools;
  for (const auto& [number, tool] : given["tools"].items())
    tools.add(static_cast<std::uint32_t>(std::stoul(number)), bytes_of<Digest>(tool));
  v1::DownPacket first;  // the vector is the first run of the packet
  if (packet.entries_size() > 0) *first.add_entries() = packet.entries(0);
  const auto entries = wire::entries_of(first, tools);
  if (!entries) return entries.error().message;
  Json out = Json::array();
  for (const wire::IndexedEntry& one : *entries)
    out.push_back({one.index, one.entry.room_seq.value, to_hex(wire::to_wire(one.entry.cut).SerializeAsString())});
  return out;
}

Json tool_state(const Json& given) {
  v1::ToolState sent;
  wire::KnownToolState known;
  if (!sent.ParseFromString(from_hex(given["state"]))) return "not parsed";
  const auto newer = wire::take_over(sent, known);
  if (!newer) return newer.error().message;
  const CuttingState& state = known.state;
  const QuantisedPose pose = quantise(state.pose_bone_tool);
  const Vec3& force_n = state.force_physical_N;
  return {{"author", state.author.value},
          {"state_seq", state.state_seq},
          {"buttons", known.buttons},
          {"spindle_rpm", state.spindle_rpm},
          {"phase", static_cast<int>(state.phase)},
          {"time_us", state.time_ns / 1000},
          {"blows", state.blows},
          {"position", pose.position},
          {"rotation", pose.rotation},
          {"tool_name", state.tool_name},
          {"force", {force_n.x(), force_n.y(), force_n.z()}},
          {"torque", state.torque_Nmm},
          {"feed", state.feed_mm_per_s},
          {"density", state.density_g_cm3},
          {"engaged", state.engaged_fraction},
          {"depth", state.depth_mm},
          {"flutes_full", state.flutes_full},
          {"force_hand", state.force_hand_N},
          {"device_holds", state.device_holds_N},
          {"cortex", state.cortex_mm},
          {"seated", state.seated},
          {"blow_impulse", state.blow_impulse_N_s}};
}

Json next_key(const Json& given) {
  const SealKey next = osteon::next_key(bytes_of<SealKey>(given["key"]));
  return to_hex({reinterpret_cast<const char*>(next.bytes.data()), next.bytes.size()});
}

const std::map<std::string, std::function<Json(const Json&)>>& checks() {
  static const std::map<std::string, std::function<Json(const Json&)>> all{{"tool_hash", tool_hash},
                                                                           {"surface_hash", surface_hash},
                                                                           {"block", block},
                                                                           {"first_entry", next_entry},
                                                                           {"next_entry", next_entry},
                                                                           {"signed_entries", signed_entries},
                                                                           {"signed_register", signed_register},
                                                                           {"datagram", datagram},
                                                                           {"tool_state", tool_state},
                                                                           {"next_key", next_key}};
  return all;
}

// The Python client checks these two with a running server: a field's leaves come packed here, and a seal's function
// belongs to the store alone.
const std::array<std::string, 2> kElsewhere{"field_hash", "witness_seal"};

TEST(Vectors, HoldInTheProgramsToo) {
  std::ifstream file(OSTEON_VECTORS);
  ASSERT_TRUE(file);
  int checked = 0;
  for (const Json& vector : joined(Json::parse(file))) {
    const auto name = vector["name"].get<std::string>(), check = vector["check"].get<std::string>();
    if (std::ranges::find(kElsewhere, check) != kElsewhere.end()) continue;
    ASSERT_TRUE(checks().contains(check)) << check;
    EXPECT_EQ(checks().at(check)(vector["given"]), vector["expected"]) << name;
    ++checked;
  }
  EXPECT_GE(checked, 26);
}

}  // namespace
}  // namespace osteon::test
