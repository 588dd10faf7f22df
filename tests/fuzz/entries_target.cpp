#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "common/core/check.hpp"
#include "server/storage/journal_entries.hpp"
#include "tests/fuzz/entries_input.hpp"
#include "tests/fuzz/journal_target.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::fuzz {
namespace {

using namespace std::chrono_literals;

constexpr double kPitch_mm = 1.0, kFirst_mm = 37.0, kLast_mm = 42.0, kMiddle_mm = 39.5;
constexpr std::int32_t kFirstLeaf = 32, kSecondLeaf = 40;  // along each axis
constexpr CutLimits kLimits{.time_slack = 1s, .swept_voxels_per_s = 5e8, .power_w = 500.0};

// A cube of 2 x 2 x 2 leaves, all in one branch of the volumes' trees, and a box of two tools. It is so small that a
// room is made and compared in microseconds.
const Case& bone() {
  static const Case made = [] {
    const Box extent{Vec3::Constant(kFirst_mm), Vec3::Constant(kLast_mm)};
    const auto distance_mm = [&](const Vec3& p) {
      const Vec3 q = (p - extent.centre_mm()).cwiseAbs() - 0.5 * extent.size_mm();
      return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
    };
    return test::make_bone(extent, kPitch_mm, distance_mm, [](const Vec3&) { return 1.9; });
  }();
  return made;
}
Tool drill() {
  Tool tool = find_tool("drill-3.2").value();
  tool.cut_level = 1;
  return tool;
}
Tool sleeve() { return find_tool("guide-1").value(); }

const RoomGenesis& beginning() {
  static const RoomGenesis made = [] {
    auto tools = std::make_shared<ToolBox>();
    tools->add(drill());
    tools->add(sleeve());
    return genesis_of(Room(bone(), kLimits, tools), "a room");
  }();
  return made;
}

Room begun() {
  Result<Room> room = begin_room(bone(), beginning(), kLimits);
  OSTEON_CHECK(room.has_value());
  return std::move(*room);
}

void expect_same(const Room& one, const Room& other) {
  OSTEON_CHECK(one.room_hash() == other.room_hash());
  OSTEON_CHECK(one.items() == other.items() && one.bodies() == other.bodies() && one.marks() == other.marks());
  const std::vector<SceneItem> items = one.items();
  OSTEON_CHECK(items.size() <= kMostItems && std::ranges::is_sorted(items, std::less_equal{}, &SceneItem::id));
}

// Asks for the surface as the surface's thread does after an event. The bone bounds the work, whatever the entries
// contain.
void draw(Room& room) {
  const std::vector<BlockKey> blocks = room.bone_blocks();
  OSTEON_CHECK(blocks.size() <= 1000 * kMostBodies);
  for (std::size_t i = 0; i < std::min<std::size_t>(blocks.size(), 2); ++i) (void)room.gather_block(blocks[i]);
}

// Gives both rooms the same events. Both must end in the same state.
void go_on(Room& one, Room& other) {
  const AuthorId someone{1};
  for (Room* room : {&one, &other}) (void)room->undo_to(someone, RoomSeq{0});
  expect_same(one, other);
  for (Room* room : {&one, &other}) (void)room->redo_last(someone, 1);
  expect_same(one, other);
}

// `room` receives every entry. `other` receives the accepted entries, encoded and decoded once more. If a refused entry
// changes anything, the two rooms differ at the end.
void replay_any_entries(std::span<const std::uint8_t> data, bool evaluate) {
  const EntriesInput input = entries_input(data);
  const unsigned how = input.how;
  const RoomSeq checkpoint{evaluate && (how & kFromCheckpoint) ? input.checkpoint % 16u : 0u};
  Room room = begun(), other = begun();
  const auto reach_checkpoint = [&] { OSTEON_CHECK(other.set_fields(room.all_leaves()).has_value()); };
  std::chrono::nanoseconds at{};
  for (const Record& record : input.records) {
    const RoomSeq seq{room.room_seq().value + 1 + static_cast<std::uint64_t>(record.off)};
    const std::chrono::nanoseconds when = time_of(record, at);
    const Result<LogEntry> entry = entry_from_bytes(seq, when, record.bytes);
    if (how & kAsText) {
      const Result<std::string> line = entry_as_json(seq, when, record.bytes);
      OSTEON_CHECK(line ? line->find('\n') == std::string::npos : !entry);
    }
    if (!entry) continue;
    const std::string written = to_bytes(*entry);
    const Result<LogEntry> read = entry_from_bytes(seq, when, written);
    OSTEON_CHECK(read && to_bytes(*read) == written);
    if (!room.replay(*entry, evaluate ? Room::Fields::evaluate : Room::Fields::leave)) continue;
    at = room.time();
    const bool evaluate_here = evaluate && seq > checkpoint;
    OSTEON_CHECK(other.replay(*read, evaluate_here ? Room::Fields::evaluate : Room::Fields::leave).has_value());
    if (evaluate && seq == checkpoint) reach_checkpoint();
  }
  if (evaluate && room.room_seq() < checkpoint) reach_checkpoint();
  OSTEON_CHECK(room.take_entries().empty() && room.time() == other.time());
  expect_same(room, other);
  if (!evaluate) return;
  if (how & kDraw) draw(room);
  if (how & kGoOn) go_on(room, other);
}

void begin_any_room(std::span<const std::uint8_t> data) {
  const Result<RoomGenesis> genesis = genesis_from_bytes({reinterpret_cast<const char*>(data.data()), data.size()});
  if (!genesis) return;
  const std::string written = to_bytes(*genesis);
  const Result<RoomGenesis> read = genesis_from_bytes(written);
  OSTEON_CHECK(read && to_bytes(*read) == written);
  const Result<Room> room = begin_room(bone(), *genesis, kLimits);
  if (!room) return;
  const Result<Room> again = begin_room(bone(), *read, kLimits);
  OSTEON_CHECK(again && again->genesis() == genesis->room_genesis);
  expect_same(*room, *again);
}

// Seeds: decisions of a real room.

EntriesInput as_input(Room& room, unsigned how, std::uint8_t checkpoint) {
  EntriesInput input{static_cast<std::uint8_t>(how), checkpoint, {}};
  std::chrono::nanoseconds at{};
  for (const LogEntry& entry : room.take_entries()) {
    input.records.push_back({0, static_cast<std::int8_t>((entry.at - at) / kStep), to_bytes(entry)});
    at = entry.at;
  }
  return input;
}

void cut_down(Room& room, AuthorId hand, double x_mm) {
  room.set_time(room.time() + kStep);
  const Vec3 from{kMiddle_mm + x_mm, kMiddle_mm, kLast_mm}, down{0, 0, -1};
  Cut cut = test::straight_cut(drill(), from, from + down, down, room.decided(hand) + 1);
  cut.author = hand;
  cut.lease_epoch = room.lease_epoch(hand);
  cut.path_us = 8000;
  OSTEON_CHECK(room.submit(cut).has_value());
}

// Half of the bone along x, by masks that take whole leaves.
Fragment half(bool upper) {
  Fragment fragment;
  fragment.volume_mm3 = 100;
  fragment.bounds = bone().bounds();
  (upper ? fragment.bounds.min_mm : fragment.bounds.max_mm).x() = kSecondLeaf * kPitch_mm;
  const auto gone = static_cast<std::int16_t>(-4 * kPitch_mm * 1024);
  for (int x : {kFirstLeaf, kSecondLeaf})
    for (int y : {kFirstLeaf, kSecondLeaf})
      for (int z : {kFirstLeaf, kSecondLeaf})
        ((x == kSecondLeaf) == upper ? fragment.taken : fragment.left).push_back({BodyId{0}, 0, {x, y, z}, {gone}});
  return fragment;
}

SceneItem a_guide() {
  SceneItem guide;
  guide.tool = sleeve().hash();
  guide.pose_bone_item = pose_along({kMiddle_mm, kMiddle_mm, kLast_mm}, Vec3{0.1, 0.2, -1}.normalized());
  return guide;
}

std::vector<Bytes> rooms() {
  std::vector<Bytes> inputs;
  {  // every kind of entry
    Room room = begun();
    const AuthorId hand = room.join(MemberKind::surgeon, 1, Digest{{1}});
    room.join(MemberKind::watcher, 2);
    cut_down(room, hand, -1);
    Cut stale = test::straight_cut(drill(), {}, {}, {0, 0, -1}, 2);
    stale.lease_epoch = 99;
    OSTEON_CHECK(room.submit(stale)->rejection == Rejection::lease);
    Tool other = drill();
    other.name = "drill-4";
    other.diameter_mm = 4;
    OSTEON_CHECK(room.add_tool(hand, other) && room.mark(hand, "before the saw"));
    OSTEON_CHECK(room.set_item(hand, a_guide()) && room.remove_item(hand, 1));
    OSTEON_CHECK(room.split(BodyId{0}, {half(true)}, room.bone_epoch()) && room.remove_body(hand, BodyId{1}));
    OSTEON_CHECK(room.undo_last(hand, 2, {}) && room.redo_last(hand, 1));
    const AuthorId teacher = room.join(MemberKind::surgeon, 3, {}, Role::instructor);
    OSTEON_CHECK(room.supervise(teacher, hand,
                                {.stopped = true,
                                 .taken_by = teacher,
                                 .guide = teacher,
                                 .guide_share = 500,
                                 .force_limit = 300,
                                 .zone = ZoneLimit{{1, 2, 3}, 1000},
                                 .tools = {drill().hash()},
                                 .words = "wait"}));
    OSTEON_CHECK(
        room.annotate(teacher, {.kind = AnnotationKind::line, .points = {{1, 2, 3}, {4, 5, 6}}, .words = "here"}));
    OSTEON_CHECK(room.wipe_off(teacher, 1) && room.say(hand, teacher, "why?"));
    std::array<bool, std::variant_size_v<decltype(LogEntry::what)>> seen{};
    const EntriesInput input = as_input(room, kGoOn, 0);
    Room again = begun();
    for (const Record& record : input.records) {
      const auto entry =
          entry_from_bytes(RoomSeq{again.room_seq().value + 1}, time_of(record, again.time()), record.bytes);
      OSTEON_CHECK(entry && again.replay(*entry));
      seen[entry->what.index()] = true;
    }
    OSTEON_CHECK(again.room_hash() == room.room_hash() && std::ranges::all_of(seen, std::identity{}));
    inputs.push_back(to_bytes(input));
  }
  {  // cuts, undo and redo
    Room room = begun();
    const AuthorId one = room.join(MemberKind::surgeon), two = room.join(MemberKind::surgeon);
    cut_down(room, one, -2);
    cut_down(room, two, 2);
    OSTEON_CHECK(room.undo_last(one, 1, one).has_value());
    cut_down(room, one, 0);
    OSTEON_CHECK(room.redo_last(two, 1).has_value());
    inputs.push_back(to_bytes(as_input(room, kFromCheckpoint | kGoOn, 5)));
  }
  {  // fragments, one of which is removed
    Room room = begun();
    const AuthorId hand = room.join(MemberKind::surgeon);
    OSTEON_CHECK(room.split(BodyId{0}, {half(false)}, room.bone_epoch()).has_value());
    cut_down(room, hand, 1);
    OSTEON_CHECK(room.remove_body(hand, BodyId{1}) && room.undo_last(hand, 1, {}));
    inputs.push_back(to_bytes(as_input(room, kFromCheckpoint | kDraw, 3)));
  }
  {  // the scene
    Room room = begun();
    const AuthorId hand = room.join(MemberKind::watcher, 3);
    OSTEON_CHECK(room.set_item(hand, a_guide()) && room.set_item(hand, a_guide()) && room.undo_last(hand, 1, {}));
    inputs.push_back(to_bytes(as_input(room, kAsText, 0)));
  }
  return inputs;
}

}  // namespace

Target entries_target() {
  const auto run = [](std::span<const std::uint8_t> data) { replay_any_entries(data, false); };
  return {"journal_entries", run, rooms(), 2000, change_entries};
}

Target evaluated_entries_target() {
  const auto run = [](std::span<const std::uint8_t> data) { replay_any_entries(data, true); };
  return {"journal_entries_evaluated", run, rooms(), 1000, change_entries};
}

Target genesis_target() {
  const std::string bytes = to_bytes(beginning());
  const std::string bare = to_bytes(genesis_of(Room(bone(), kLimits, std::make_shared<ToolBox>()), "no tools"));
  return {"journal_genesis", begin_any_room, {{bytes.begin(), bytes.end()}, {bare.begin(), bare.end()}}};
}

}  // namespace osteon::fuzz
