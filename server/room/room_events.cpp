// What a room decides besides cuts: undo and redo, pieces, the scene, tools, marks.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <tuple>

#include "common/field/kernel.hpp"
#include "common/tools/scene.hpp"
#include "server/room/room.hpp"

namespace osteon {
namespace {

// Key, in a body's history, of a field that was loaded. It is no event of its own. Sequence numbers stay below it.
constexpr std::uint64_t kLoaded = std::uint64_t{1} << 62;

auto position_of(const FieldLeaf& leaf) { return std::tuple(leaf.level, leaf.origin); }

// Unites the masks of several fragments. A leaf that several masks contain is kept once, with the smallest values.
std::vector<FieldLeaf> united(std::vector<FieldLeaf> masks) {
  if (std::ranges::is_sorted(masks, std::less_equal{}, position_of)) return masks;
  std::ranges::stable_sort(masks, {}, position_of);
  std::vector<FieldLeaf> out;
  for (FieldLeaf& leaf : masks) {
    if (out.empty() || out.back().level != leaf.level || out.back().origin != leaf.origin) {
      out.push_back(std::move(leaf));
      continue;
    }
    FieldLeaf& last = out.back();
    if (!leaf.is_constant()) last.expand();
    for (std::size_t i = 0; i < last.values.size(); ++i) last.values[i] = std::min(last.values[i], leaf.value(i));
    last.compact();
  }
  return out;
}

Mask shared(std::vector<FieldLeaf> mask) {
  return std::make_shared<const std::vector<FieldLeaf>>(united(std::move(mask)));
}

bool is_guide(const Tool& tool) {
  return tool.kind == ToolKind::drill_sleeve || tool.kind == ToolKind::distal_block ||
         tool.kind == ToolKind::four_in_one_block;
}

// A room that continues from a saved state began with that state.
Digest begun_with(const Digest& genesis, const SavedFields& saved) {
  Hasher hasher;
  hasher.text("osteon-room-resumed-1");
  hasher.bytes(std::as_bytes(std::span(genesis.bytes)));
  hasher.integer(saved.room_seq.value);
  const Digest fields = field_hash(saved.leaves, saved.pitch_mm);
  hasher.bytes(std::as_bytes(std::span(fields.bytes)));
  hasher.integer(saved.items.size());
  return hasher.finish();
}

}  // namespace

Result<Room> Room::resume(Case bone, const SavedFields& saved, CutLimits limits, std::shared_ptr<ToolBox> tools) {
  if (saved.case_hash != bone.hash())
    return failure(ErrorCode::unsupported, "the saved fields are of the case " + to_hex(saved.case_hash) +
                                               " and not of " + to_hex(bone.hash()) +
                                               "; start the server with that case");
  if (saved.kernel_version != kKernelVersion)
    return failure(ErrorCode::unsupported, "the saved fields are of cut kernel version " +
                                               std::to_string(saved.kernel_version) + " and this server's is " +
                                               std::to_string(kKernelVersion) +
                                               "; resume them with the release that saved them");
  Room room(bone, limits, std::move(tools));
  room.room_seq_ = saved.room_seq;
  room.genesis_ = begun_with(room.genesis_, saved);
  room.bodies_.at(BodyId{0}).present = std::ranges::find(saved.bodies, BodyId{0}) != saved.bodies.end();
  for (const BodyId id : saved.bodies) {
    room.last_body_ = std::max(room.last_body_, id.value);
    if (id != BodyId{0}) room.add_body(id, CutField(bone, id, room.tools_), {}, bone.bounds_samples());
  }
  std::map<BodyId, std::vector<FieldLeaf>> leaves;
  for (const FieldLeaf& leaf : saved.leaves) leaves[leaf.body].push_back(leaf);
  RoomEvent nobody_hears;
  for (auto& [id, of_body] : leaves) {
    const auto found = room.bodies_.find(id);
    if (found == room.bodies_.end()) return bad_input("the saved fields have leaves of a body that they do not list");
    for (const FieldLeaf& leaf : of_body) found->second.field.restore(leaf);
    found->second.history.add_mask(RoomSeq{kLoaded}, of_body);
    room.show_whole(id, nobody_hears);
  }
  for (const Tool& tool : saved.tools)
    if (Result<void> added = room.know(tool); !added)
      return tl::unexpected(added.error());
    else if (!room.tools_->find(tool.hash()))
      room.tools_->add(tool);
  // Nobody set them, and they cannot be undone.
  room.events_[RoomSeq{}] = {.kind = EventKind::tool};
  for (const SceneItem& item : saved.items) {
    if (!room.tools_->find(item.tool)) return bad_input("the saved scene has an item of a tool that is not saved");
    if (!room.exists(item.body)) return bad_input("the saved scene has an item on a body that is not saved");
    room.items_[item.id] = {{RoomSeq{}, item}};
    room.last_item_ = std::max(room.last_item_, item.id);
  }
  return room;
}

bool Room::exists(BodyId body) const {
  const auto found = bodies_.find(body);
  return found != bodies_.end() && found->second.present;
}

std::vector<BodyId> Room::bodies() const {
  std::vector<BodyId> present;
  for (const auto& [id, body] : bodies_)
    if (body.present) present.push_back(id);
  return present;
}

const CutField* Room::find_field(BodyId body) const { return exists(body) ? &bodies_.at(body).field : nullptr; }

std::vector<BodyId> Room::all_bodies() const {
  std::vector<BodyId> all;
  for (const auto& [id, body] : bodies_) all.push_back(id);
  return all;
}

const CutField* Room::any_field(BodyId body) const {
  const auto found = bodies_.find(body);
  return found == bodies_.end() ? nullptr : &found->second.field;
}

Digest Room::field_hash() const {
  std::vector<FieldLeaf> leaves;
  for (const BodyId id : bodies()) {
    std::vector<FieldLeaf> of_body = bodies_.at(id).field.leaves();
    std::ranges::move(of_body, std::back_inserter(leaves));
  }
  return osteon::field_hash(std::move(leaves), bone().pitch_mm());
}

std::vector<SceneItem> Room::items() const {
  std::vector<SceneItem> standing;
  for (const auto& [id, states] : items_) {
    const auto newest = std::find_if(states.rbegin(), states.rend(),
                                     [&](const ItemState& state) { return !events_.at(state.seq).undone; });
    if (newest != states.rend() && newest->item && exists(newest->item->body)) standing.push_back(*newest->item);
  }
  // The pins in the scene decide whether a guide is fixed.
  const std::vector<Standing> scene = with_tools(standing);
  for (std::size_t i = 0; i < scene.size(); ++i)
    if (is_guide(scene[i].tool))
      standing[i].seated = pins_in(scene[i].tool, scene[i].item.pose_bone_item, scene) >= kPinsThatFix;
  return standing;
}

std::vector<Standing> Room::with_tools(const std::vector<SceneItem>& items) const {
  std::vector<Standing> scene;
  for (const SceneItem& item : items) scene.push_back({item, tools_->find(item.tool)->tool});
  return scene;
}

Result<void> Room::check_member(AuthorId by) const {
  if (knows(by)) return {};
  return bad_input("author " + std::to_string(by.value) + " has not joined this room; call Join first");
}

Result<RoomEvent> Room::add_tool(AuthorId by, const Tool& tool) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (const ToolBox::Entry* known = tools_->find(tool.hash())) {
    RoomEvent event;
    event.kind = EventKind::tool;
    event.tool = known;
    finish_event(event);
    return event;
  }
  if (Result<void> room_for_it = know(tool); !room_for_it) return tl::unexpected(room_for_it.error());
  return decide(by, ToolEntry{tool});
}

// Whether a tool can be added.
Result<void> Room::know(const Tool& tool) const {
  if (tools_->find(tool.hash())) return {};
  const auto entries = tools_->entries();
  if (entries.size() >= kMostTools)
    return bad_input("the room knows " + std::to_string(kMostTools) + " tools and takes no more");
  // States and lists identify tools by name, so two tools must not share a name.
  for (const ToolBox::Entry* entry : entries)
    if (entry->tool.name == tool.name)
      return failure(ErrorCode::exists,
                     "the room has another tool of the name " + tool.name + "; give this one a name of its own");
  return {};
}

// Adds the events that depend on `seqs`.
// - With a split: what was done to its piece as such.
// - With a cut: every later split of a body that the cut had reached, because the bone that comes back may hold the
//   piece.
// - With an earlier split: every later split of the same body, because the bone would come back in the later piece too.
std::set<RoomSeq> Room::with_what_falls_too(std::set<RoomSeq> seqs) const {
  std::set<BodyId> pieces_gone;
  bool more = true;
  while (more) {
    more = false;
    for (const auto& [seq, event] : events_) {
      if (event.undone || seqs.contains(seq)) continue;
      bool falls = false;
      if (event.kind == EventKind::split) {
        falls = pieces_gone.contains(event.body);
        const auto parent = bodies_.find(event.body);
        for (const RoomSeq fallen : seqs)
          falls |= fallen < seq && parent != bodies_.end() && parent->second.history.contains(fallen);
      } else if (event.kind == EventKind::remove_body) {
        falls = pieces_gone.contains(event.body);
        // Somebody removed the rest because the piece was still there. Without the piece, the room would have no bone
        // at all.
        for (const RoomSeq fallen : seqs) {
          const Event& split = events_.at(fallen);
          falls |= fallen < seq && split.kind == EventKind::split && split.body == event.body;
        }
      }
      if (falls) more = seqs.insert(seq).second;
    }
    for (const RoomSeq seq : seqs)
      for (const SplitPiece& piece : events_.at(seq).pieces) more |= pieces_gone.insert(piece.body).second;
  }
  return seqs;
}

bool Room::can_be_undone(RoomSeq seq) const {
  const auto found = events_.find(seq);
  if (found == events_.end()) return false;
  const EventKind kind = found->second.kind;
  return kind == EventKind::cut || kind == EventKind::split || kind == EventKind::remove_body ||
         kind == EventKind::scene;
}

RoomEvent Room::take_back(AuthorId by, std::set<RoomSeq> seqs) {
  const std::set<RoomSeq> falls = with_what_falls_too(std::move(seqs));
  return decide(by, UndoEntry{{falls.begin(), falls.end()}});
}

Result<RoomEvent> Room::undo(AuthorId by, std::span<const RoomSeq> seqs) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  if (seqs.empty()) return bad_input("undo names no event");
  for (const RoomSeq seq : seqs) {
    if (!can_be_undone(seq)) return bad_input("event " + std::to_string(seq.value) + " cannot be undone");
    if (events_.at(seq).undone) return bad_input("event " + std::to_string(seq.value) + " is undone already");
  }
  const std::set<RoomSeq> named(seqs.begin(), seqs.end());
  if (Result<void> may = may_take_back(by, named); !may) return tl::unexpected(may.error());
  return take_back(by, named);
}

Result<RoomEvent> Room::undo_last(AuthorId by, std::size_t count, AuthorId of) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  if (count == 0) return bad_input("undo needs a count of at least 1");
  std::set<RoomSeq> seqs;
  for (auto event = events_.rbegin(); event != events_.rend() && seqs.size() < count; ++event) {
    const Event& entry = event->second;
    if (entry.undone || (of ? entry.author != of : people_.only_own(by) && !people_.same_person(by, entry.author)))
      continue;
    if (can_be_undone(event->first) && entry.kind != EventKind::split) seqs.insert(event->first);
  }
  if (seqs.empty()) return failure(ErrorCode::unavailable, "there is nothing to undo");
  if (Result<void> may = may_take_back(by, seqs); !may) return tl::unexpected(may.error());
  return take_back(by, std::move(seqs));
}

Result<RoomEvent> Room::undo_since(AuthorId by, std::chrono::nanoseconds since) {
  const auto later =
      std::ranges::find_if(events_, [&](const auto& event) { return event.second.at >= since && event.first; });
  return undo_to(by, later == events_.end() ? room_seq_ : RoomSeq{later->first.value - 1});
}

Result<RoomEvent> Room::undo_to(AuthorId by, RoomSeq mark) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  if (mark > room_seq_) return bad_input("event " + std::to_string(mark.value) + " lies beyond the newest event");
  std::set<RoomSeq> seqs;
  for (auto event = events_.upper_bound(mark); event != events_.end(); ++event)
    if (can_be_undone(event->first) && !event->second.undone) seqs.insert(event->first);
  // A split belongs to nobody: it is undone with the cut that separated the piece.
  if (people_.only_own(by)) std::erase_if(seqs, [&](RoomSeq seq) { return events_.at(seq).kind == EventKind::split; });
  if (seqs.empty()) return failure(ErrorCode::unavailable, "there is nothing to undo");
  if (Result<void> may = may_take_back(by, seqs); !may) return tl::unexpected(may.error());
  return take_back(by, std::move(seqs));
}

Result<RoomEvent> Room::redo_last(AuthorId by, std::size_t count) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  if (count == 0) return bad_input("redo needs a count of at least 1");
  RedoEntry entry;
  for (auto event = events_.rbegin(); event != events_.rend() && entry.undos.size() < count; ++event)
    if (event->second.kind == EventKind::undo && !event->second.undone) entry.undos.push_back(event->first);
  if (entry.undos.empty()) return failure(ErrorCode::unavailable, "there is nothing to redo");
  if (Result<void> may = may_do_again(by, {entry.undos.begin(), entry.undos.end()}); !may)
    return tl::unexpected(may.error());

  std::set<RoomSeq> again;
  for (const RoomSeq undo : entry.undos) {
    // The same bone may have separated again since. Then that split holds, and the earlier one stays undone.
    const auto split_since = [&](BodyId parent) {
      return std::any_of(events_.upper_bound(undo), events_.end(), [&](const auto& later) {
        return later.second.kind == EventKind::split && !later.second.undone && later.second.body == parent;
      });
    };
    for (const RoomSeq seq : events_.at(undo).seqs)
      if (events_.at(seq).kind != EventKind::split || !split_since(events_.at(seq).body)) again.insert(seq);
  }
  if (Result<void> may = may_cut_again(by, again); !may) return tl::unexpected(may.error());
  entry.seqs.assign(again.begin(), again.end());
  return decide(by, std::move(entry));
}

Result<RoomEvent> Room::mark(AuthorId by, std::string label) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (label.empty() || label.size() > kMostLabelBytes)
    return bad_input("a mark needs a label of 1 to " + std::to_string(kMostLabelBytes) + " bytes");
  if (marks().size() >= kMostMarks)
    return bad_input("the room has " + std::to_string(kMostMarks) + " marks and takes no more");
  return decide(by, MarkEntry{std::move(label)});
}

std::vector<std::pair<RoomSeq, std::string>> Room::marks() const {
  std::vector<std::pair<RoomSeq, std::string>> marks;
  for (const auto& [seq, event] : events_)
    if (event.kind == EventKind::mark) marks.emplace_back(seq, event.label);
  return marks;
}

Result<RoomEvent> Room::remove_body(AuthorId by, BodyId body) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  if (!exists(body)) return bad_input("the room has no body " + std::to_string(body.value));
  if (bodies().size() == 1) return bad_input("body " + std::to_string(body.value) + " is the last one and stays");
  return decide(by, RemoveBodyEntry{body});
}

Result<RoomEvent> Room::split(Separation found) {
  if (found.seen != bone_epoch_ || !exists(found.parent))
    return failure(ErrorCode::unavailable, "bone has come back since these pieces were found");
  if (found.fragments.empty()) return bad_input("a split needs a piece");
  SplitEntry entry{.parent = found.parent, .taken = {}, .pieces = {}};
  std::vector<FieldLeaf> taken;
  std::uint32_t next = last_body_;
  for (Fragment& fragment : found.fragments) {
    std::ranges::move(fragment.taken, std::back_inserter(taken));
    if (fragment.debris()) continue;
    const double h = bone().pitch_mm();
    const CoordBox reach = covering_samples(fragment.bounds.grown((kBandVoxels + 1) * h), h);
    entry.pieces.push_back({BodyId{++next}, reach, shared(std::move(fragment.left))});
  }
  if (bodies().size() + entry.pieces.size() > kMostBodies)
    return bad_input("the room has " + std::to_string(kMostBodies) + " bodies and makes no more; take some away");
  entry.taken = shared(std::move(taken));
  ready_ = std::move(found.fields);
  RoomEvent event = decide(AuthorId{}, std::move(entry));
  ready_.clear();
  return event;
}

Result<RoomEvent> Room::set_item(AuthorId by, SceneItem item, const Placing& placing) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  if (!exists(item.body)) return bad_input("the room has no body " + std::to_string(item.body.value));
  if (!tools_->find(item.tool)) return bad_input("item.tool_hash names a tool that the room does not have");
  if (item.id != 0 && !items_.contains(item.id))
    return bad_input("item.item: the room has no item " + std::to_string(item.id));
  if (item.id == 0 && items_.size() >= kMostItems)
    return bad_input("the scene has had " + std::to_string(kMostItems) + " items and takes no more");
  const std::vector<SceneItem> standing = items();
  const std::vector<Standing> scene = with_tools(standing);
  const auto found = std::ranges::find(scene, item.id, [](const Standing& one) { return one.item.id; });
  const Standing* before = found == scene.end() ? nullptr : &*found;
  const Tool& tool = tools_->find(item.tool)->tool;
  const BoneQuery solid = [&body = bodies_.at(item.body).field](const Vec3& p) { return body.solid_mm(p); };
  Result<Placed> stands = placed(placing, before, {item, tool}, solid);
  if (!stands) return tl::unexpected(stands.error());
  const Box room = bone().bounds().grown(limits_.beyond_bone_mm);
  const Vec3& at = stands->item.pose_bone_item.position_mm;
  if (!((at.array() >= room.min_mm.array()).all() && (at.array() <= room.max_mm.array()).all()))
    return bad_input("item.pose_bone_item is too far from the bone");
  Result<SceneItem> ruled = set_by_rules(scene, before, {stands->item, tool}, solid);
  if (!ruled) return tl::unexpected(ruled.error());
  item = *ruled;
  if (item.id == 0) item.id = last_item_ + 1;
  item.set_at = room_seq_.value + 1;
  RoomEvent event = decide(by, ItemEntry{item.id, item});
  event.set = Placed{item, stands->contact_fraction};
  return event;
}

Result<RoomEvent> Room::remove_item(AuthorId by, std::uint32_t item) {
  if (Result<void> may = may_change(by); !may) return tl::unexpected(may.error());
  const auto standing = items();
  const auto found = std::ranges::find(standing, item, &SceneItem::id);
  if (found == standing.end()) return bad_input("item " + std::to_string(item) + " does not stand in the scene");
  const Tool& tool = tools_->find(found->tool)->tool;
  if (is_guide(tool) && found->seated) return bad_input("\"" + tool.name + "\" is fixed by pins; draw a pin first");
  return decide(by, ItemEntry{item, std::nullopt});
}

}  // namespace osteon
