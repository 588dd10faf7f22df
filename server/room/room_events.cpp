// The room's events beside cuts: undo and redo, pieces, the scene, tools.
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

// Keys in a body's history for what is no event of its own: the mask that leaves a piece of its parent, and a field that
// was loaded. Places of events stay below.
constexpr std::uint64_t kLeftOfSplit = std::uint64_t{1} << 63, kLoaded = std::uint64_t{1} << 62;

tl::unexpected<Error> refuse(std::string why) { return failure(ErrorCode::invalid_input, std::move(why)); }

auto place_of(const FieldLeaf& leaf) { return std::tuple(leaf.level, leaf.origin); }

// Masks of several fragments as one: a leaf that several name is taken once, with the least values.
std::vector<FieldLeaf> united(std::vector<FieldLeaf> masks) {
  if (std::ranges::is_sorted(masks, std::less_equal{}, place_of)) return masks;
  std::ranges::stable_sort(masks, {}, place_of);
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

Mask shared(std::vector<FieldLeaf> mask) { return std::make_shared<const std::vector<FieldLeaf>>(united(std::move(mask))); }

bool is_guide(const Tool& tool) {
  return tool.kind == ToolKind::drill_sleeve || tool.kind == ToolKind::distal_block || tool.kind == ToolKind::four_in_one_block;
}

CoordBox level_0_box(int level, Coord origin) {
  return {shift_down(origin, level), shift_down(origin + Coord{kLeafSize, kLeafSize, kLeafSize}, level)};
}

bool meet(const CoordBox& a, const CoordBox& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y && a.min.z <= b.max.z &&
         b.min.z <= a.max.z;
}

}  // namespace

Result<Room> Room::resume(Case bone, const SavedFields& saved, CutLimits limits, std::shared_ptr<ToolBox> tools) {
  if (saved.case_hash != bone.hash())
    return failure(ErrorCode::unsupported, "the saved fields are of the case " + to_hex(saved.case_hash) + " and not of " +
                                               to_hex(bone.hash()) + "; start the server with that case");
  if (saved.kernel_version != kKernelVersion)
    return failure(ErrorCode::unsupported, "the saved fields are of cut kernel version " + std::to_string(saved.kernel_version) +
                                               " and this server's is " + std::to_string(kKernelVersion) +
                                               "; resume them with the release that saved them");
  Room room(bone, limits, std::move(tools));
  room.room_seq_ = saved.room_seq;
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
    if (found == room.bodies_.end()) return refuse("the saved fields have leaves of a body that they do not list");
    for (const FieldLeaf& leaf : of_body) found->second.field.restore(leaf);
    found->second.history.add_mask(RoomSeq{kLoaded}, of_body);
    room.show_whole(id, nobody_hears);
  }
  for (const Tool& tool : saved.tools)
    if (Result<void> added = room.know(tool); !added) return tl::unexpected(added.error());
  // Set by nobody and not to be undone.
  room.events_[RoomSeq{}] = {.kind = EventKind::tool};
  for (const SceneItem& item : saved.items) {
    if (!room.tools_->find(item.tool)) return refuse("the saved scene has an item of a tool that is not saved");
    if (!room.exists(item.body)) return refuse("the saved scene has an item on a body that is not saved");
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
  for (const auto& [id, rows] : items_) {
    const auto newest =
        std::find_if(rows.rbegin(), rows.rend(), [&](const ItemRow& row) { return !events_.at(row.place).undone; });
    if (newest != rows.rend() && newest->item && exists(newest->item->body)) standing.push_back(*newest->item);
  }
  // Whether a guide is fixed follows from the pins that stand with it.
  const std::vector<Standing> scene = with_tools(standing);
  for (std::size_t i = 0; i < scene.size(); ++i)
    if (is_guide(scene[i].tool)) standing[i].seated = pins_in(scene[i].tool, scene[i].item.pose_bone_item, scene) >= kPinsThatFix;
  return standing;
}

std::vector<Standing> Room::with_tools(const std::vector<SceneItem>& items) const {
  std::vector<Standing> scene;
  for (const SceneItem& item : items) scene.push_back({item, tools_->find(item.tool)->tool});
  return scene;
}

Result<void> Room::check_member(AuthorId by) const {
  if (knows(by)) return {};
  return refuse("author " + std::to_string(by.value) + " has not joined this room; call Join first");
}

RoomEvent Room::begin_event(EventKind kind, AuthorId by, Event row) {
  room_seq_ = RoomSeq{room_seq_.value + 1};
  row.kind = kind;
  row.author = by;
  events_[room_seq_] = std::move(row);
  RoomEvent event;
  event.room_seq = room_seq_;
  event.kind = kind;
  event.author = by;
  return event;
}

void Room::finish_event(RoomEvent& event) const {
  event.bodies = bodies();
  event.lease_epoch = lease_epoch_;
}

void Room::note_changed(BodyId id, const std::vector<LevelLeaves>& changed, RoomEvent* event) {
  Body& body = bodies_.at(id);
  for (const LevelLeaves& leaves : changed) {
    if (leaves.origins.empty()) continue;
    for (const BlockKey& key : body.surface.touch(leaves.level, leaves.origins)) stale_.insert(key);
    changes_.push_back({id, leaves.level, leaves.origins});
    if (!event) continue;
    for (const Coord origin : leaves.origins) {
      FieldLeaf& leaf = event->leaves.emplace_back(FieldLeaf{id, leaves.level, origin, {}});
      body.field.read(leaf);
    }
  }
}

void Room::add_body(BodyId id, CutField field, CutHistory history, const CoordBox& reach) {
  bodies_.emplace(id, Body{std::move(field), std::move(history), SurfaceBlocks(id), reach});
}

// Every leaf of a body that comes or comes back, and every block that it may be drawn with.
void Room::show_whole(BodyId id, RoomEvent& event) {
  Body& body = bodies_.at(id);
  std::vector<FieldLeaf> leaves = body.field.leaves();
  std::map<int, std::vector<Coord>> cut;
  for (const FieldLeaf& leaf : leaves)
    if (meet(level_0_box(leaf.level, leaf.origin), body.reach)) cut[leaf.level].push_back(leaf.origin);
  // Most of a piece's leaves are gone throughout and far from it: only those round it are drawn.
  for (const auto& [level, origins] : cut)
    for (const BlockKey& key : body.surface.touch(level, origins)) stale_.insert(key);
  std::vector<BlockKey> whole;
  list_blocks(id, body, whole);
  stale_.insert(whole.begin(), whole.end());
  stale_.merge(focused(body));
  for (const BlockKey& key : body.surface.coarse_blocks()) stale_.insert(key);
  std::ranges::move(leaves, std::back_inserter(event.leaves));
  event.bone = true;
}

Result<RoomEvent> Room::add_tool(AuthorId by, const Tool& tool) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  RoomEvent event;
  if (const ToolBox::Entry* known = tools_->find(tool.hash())) {
    event.kind = EventKind::tool;
    event.tool = known;
    finish_event(event);
    return event;
  }
  if (Result<void> known = know(tool); !known) return tl::unexpected(known.error());
  event = begin_event(EventKind::tool, by, {});
  event.tool = tools_->find(tool.hash());
  finish_event(event);
  return event;
}

Result<void> Room::know(const Tool& tool) {
  if (tools_->find(tool.hash())) return {};
  const auto entries = tools_->entries();
  if (entries.size() >= kMostTools) return refuse("the room knows " + std::to_string(kMostTools) + " tools and takes no more");
  // States and lists name tools by their names, so that two must not have one.
  for (const ToolBox::Entry* entry : entries)
    if (entry->tool.name == tool.name)
      return failure(ErrorCode::exists, "the room has another tool of the name " + tool.name + "; give this one a name of its own");
  tools_->add(tool);
  return {};
}

// What was done to a piece as such falls with the split that made it; with a cut falls every later split of a body that
// the cut had reached, since the bone that comes back may hold the piece; and so with an earlier split of that body, whose
// bone would come back in the later piece too.
std::set<RoomSeq> Room::with_what_falls_too(std::set<RoomSeq> places) const {
  std::set<BodyId> pieces_gone;
  bool more = true;
  while (more) {
    more = false;
    for (const auto& [place, event] : events_) {
      if (event.undone || places.contains(place)) continue;
      bool falls = false;
      if (event.kind == EventKind::split) {
        falls = pieces_gone.contains(event.body);
        const auto parent = bodies_.find(event.body);
        for (const RoomSeq fallen : places)
          falls |= fallen < place && parent != bodies_.end() && parent->second.history.contains(fallen);
      } else if (event.kind == EventKind::remove_body) {
        falls = pieces_gone.contains(event.body);
      }
      if (falls) more = places.insert(place).second;
    }
    for (const RoomSeq place : places)
      for (const Piece& piece : events_.at(place).pieces) more |= pieces_gone.insert(piece.body).second;
  }
  return places;
}

Result<RoomEvent> Room::undo(AuthorId by, std::span<const RoomSeq> places) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (places.empty()) return refuse("undo names no event");
  for (const RoomSeq place : places) {
    const auto found = events_.find(place);
    const auto is = [&](EventKind kind) { return found->second.kind == kind; };
    if (found == events_.end() ||
        !(is(EventKind::cut) || is(EventKind::split) || is(EventKind::remove_body) || is(EventKind::scene)))
      return refuse("event " + std::to_string(place.value) + " is none that can be undone");
    if (found->second.undone) return refuse("event " + std::to_string(place.value) + " is undone already");
  }
  return take_back(by, with_what_falls_too({places.begin(), places.end()}));
}

Result<RoomEvent> Room::undo_last(AuthorId by, std::size_t count, AuthorId of) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (count == 0) return refuse("undo needs a count of at least 1");
  std::set<RoomSeq> places;
  for (auto event = events_.rbegin(); event != events_.rend() && places.size() < count; ++event) {
    const Event& row = event->second;
    if (row.undone || (of && row.author != of)) continue;
    if (row.kind == EventKind::cut || row.kind == EventKind::remove_body || row.kind == EventKind::scene)
      places.insert(event->first);
  }
  if (places.empty()) return failure(ErrorCode::unavailable, "there is nothing to undo");
  return take_back(by, with_what_falls_too(std::move(places)));
}

RoomEvent Room::take_back(AuthorId by, const std::set<RoomSeq>& falls) {
  const std::vector<RoomSeq> places(falls.begin(), falls.end());
  RoomEvent event = begin_event(EventKind::undo, by, {.places = places});
  event.places = places;
  std::set<BodyId> back;
  for (auto place = falls.rbegin(); place != falls.rend(); ++place) {
    Event& row = events_.at(*place);
    row.undone = true;
    event.scene |= row.kind == EventKind::scene || row.kind == EventKind::split || row.kind == EventKind::remove_body;
    event.bone |= row.kind != EventKind::scene;
    for (const Piece& piece : row.pieces) {
      bodies_.erase(piece.body);
      back.erase(piece.body);
    }
    if (row.kind != EventKind::remove_body) continue;
    bodies_.at(row.body).present = true;
    back.insert(row.body);
  }
  for (auto& [id, body] : bodies_) {
    const auto changed = body.history.undo(body.field, places);
    if (body.present && !back.contains(id)) note_changed(id, changed, &event);
  }
  for (const BodyId id : back) show_whole(id, event);
  if (event.bone) {
    ++lease_epoch_;
    ++bone_changes_;
  }
  finish_event(event);
  return event;
}

Result<RoomEvent> Room::redo_last(AuthorId by, std::size_t count) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (count == 0) return refuse("redo needs a count of at least 1");
  std::vector<RoomSeq> undos;  // newest first
  for (auto event = events_.rbegin(); event != events_.rend() && undos.size() < count; ++event)
    if (event->second.kind == EventKind::undo && !event->second.undone) undos.push_back(event->first);
  if (undos.empty()) return failure(ErrorCode::unavailable, "there is nothing to redo");

  std::set<RoomSeq> again;
  for (const RoomSeq undo : undos) {
    Event& row = events_.at(undo);
    row.undone = true;
    // The same bone may have come off again meanwhile: that split stands, and the earlier one stays undone.
    const auto split_since = [&](BodyId parent) {
      return std::any_of(events_.upper_bound(undo), events_.end(), [&](const auto& later) {
        return later.second.kind == EventKind::split && !later.second.undone && later.second.body == parent;
      });
    };
    for (const RoomSeq place : row.places)
      if (events_.at(place).kind != EventKind::split || !split_since(events_.at(place).body)) again.insert(place);
  }

  RoomEvent event = begin_event(EventKind::redo, by, {});
  // Cuts first: a piece is made from its parent as it is with all of them.
  std::vector<RoomSeq> cuts;
  for (const RoomSeq place : again)
    if (events_.at(place).kind == EventKind::cut) cuts.push_back(place);
  for (auto& [id, body] : bodies_) {
    const auto changed = body.history.redo(body.field, cuts);
    if (body.present) note_changed(id, changed, &event);
  }
  for (const RoomSeq place : again) {
    Event& row = events_.at(place);
    if ((row.kind == EventKind::split || row.kind == EventKind::remove_body) && !exists(row.body)) continue;
    row.undone = false;
    event.places.push_back(place);
    event.scene |= row.kind == EventKind::scene || row.kind == EventKind::split || row.kind == EventKind::remove_body;
    event.bone |= row.kind != EventKind::scene;
    if (row.kind == EventKind::split) cut_apart(place, row, event);
    if (row.kind == EventKind::remove_body) bodies_.at(row.body).present = false;
  }
  if (event.bone) {
    ++lease_epoch_;
    ++bone_changes_;
  }
  // A body that was changed and then taken away again is not told of.
  std::erase_if(event.leaves, [&](const FieldLeaf& leaf) { return !exists(leaf.body); });
  finish_event(event);
  return event;
}

Result<RoomEvent> Room::remove_body(AuthorId by, BodyId body) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (!exists(body)) return refuse("the room has no body " + std::to_string(body.value));
  if (bodies().size() == 1) return refuse("body " + std::to_string(body.value) + " is the last one and stays");
  RoomEvent event = begin_event(EventKind::remove_body, by, {.body = body});
  bodies_.at(body).present = false;
  ++bone_changes_;
  event.bone = event.scene = true;
  finish_event(event);
  return event;
}

Result<RoomEvent> Room::split(Separation found) {
  if (found.seen != lease_epoch_ || !exists(found.parent))
    return failure(ErrorCode::unavailable, "bone has come back since these pieces were found");
  if (found.fragments.empty()) return refuse("a split needs a piece");
  Event row{.body = found.parent};
  std::vector<FieldLeaf> taken;
  std::uint32_t next = last_body_;
  for (Fragment& fragment : found.fragments) {
    std::ranges::move(fragment.taken, std::back_inserter(taken));
    if (fragment.debris()) continue;
    const double h = bone().pitch_mm();
    const CoordBox reach = covering_samples(fragment.bounds.grown((kBandVoxels + 1) * h), h);
    row.pieces.push_back({BodyId{++next}, reach, shared(std::move(fragment.left))});
  }
  if (bodies().size() + row.pieces.size() > kMostBodies)
    return refuse("the room has " + std::to_string(kMostBodies) + " bodies and makes no more; take some away");
  row.taken = shared(std::move(taken));
  last_body_ = next;
  RoomEvent event = begin_event(EventKind::split, AuthorId{}, std::move(row));
  cut_apart(event.room_seq, events_.at(event.room_seq), event, std::move(found.fields));
  event.scene = true;
  ++bone_changes_;
  finish_event(event);
  return event;
}

// A copy of the parent with all but the piece gone.
CutField Room::made_piece(const Body& parent, const Piece& piece) const {
  CutField field(bone(), piece.body, tools_);
  for (const FieldLeaf& leaf : parent.field.leaves()) field.restore(leaf);
  for (const FieldLeaf& leaf : *piece.left) field.merge(leaf);
  return field;
}

// What the parent lost since the copy that a piece was made from; between split and undo a field only falls.
void Room::catch_up(const Body& parent, CutField& field) const {
  FieldLeaf leaf;
  for (const BodyLeaves& change : changes_) {
    if (change.body != parent.field.body()) continue;
    for (const Coord origin : change.origins) {
      leaf.level = change.level;
      leaf.origin = origin;
      parent.field.read(leaf);
      field.merge(leaf);
    }
  }
}

// The pieces are copies of the parent, each with all but itself gone; then the parent loses them.
void Room::cut_apart(RoomSeq place, Event& row, RoomEvent& event, std::vector<CutField> fields) {
  Body& parent = bodies_.at(row.body);
  const RoomSeq left_key{kLeftOfSplit | place.value};
  const bool ready = fields.size() == row.pieces.size();
  for (std::size_t i = 0; i < row.pieces.size(); ++i) {
    const Piece& piece = row.pieces[i];
    const bool use = ready && fields[i].body() == piece.body;
    if (use) catch_up(parent, fields[i]);
    CutField field = use ? std::move(fields[i]) : made_piece(parent, piece);
    CutHistory history = parent.history.fork();
    history.add_mask(left_key, piece.left);
    add_body(piece.body, std::move(field), std::move(history), piece.reach);
  }
  std::vector<LevelLeaves> changed;
  if (parent.history.contains(place)) {
    const RoomSeq again[] = {place};
    changed = parent.history.redo(parent.field, again);
  } else {
    parent.history.add_mask(place, row.taken);
    std::map<int, std::vector<Coord>> origins;
    for (const FieldLeaf& leaf : *row.taken)
      if (parent.field.merge(leaf)) origins[leaf.level].push_back(leaf.origin);
    for (auto& [level, of_level] : origins) changed.push_back({level, std::move(of_level)});
  }
  note_changed(row.body, changed, &event);
  for (const Piece& piece : row.pieces) show_whole(piece.body, event);
  event.bone = true;
}

Result<RoomEvent> Room::set_item(AuthorId by, SceneItem item, const Placing& placing) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (!exists(item.body)) return refuse("the room has no body " + std::to_string(item.body.value));
  if (!tools_->find(item.tool)) return refuse("item.tool_hash is of no tool that the room knows");
  if (item.id != 0 && !items_.contains(item.id)) return refuse("item.item: the room has no item " + std::to_string(item.id));
  if (item.id == 0 && items_.size() >= kMostItems)
    return refuse("the scene has had " + std::to_string(kMostItems) + " items and takes no more");
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
    return refuse("item.pose_bone_item is too far from the bone");
  Result<SceneItem> ruled = set_by_rules(scene, before, {stands->item, tool}, solid);
  if (!ruled) return tl::unexpected(ruled.error());
  item = *ruled;
  if (item.id == 0) item.id = ++last_item_;
  RoomEvent event = begin_event(EventKind::scene, by, {.item = item.id});
  item.set_at = event.room_seq.value;
  items_[item.id].push_back({event.room_seq, item});
  event.item = item.id;
  event.set = Placed{item, stands->contact_fraction};
  event.scene = true;
  finish_event(event);
  return event;
}

Result<RoomEvent> Room::remove_item(AuthorId by, std::uint32_t item) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  const auto standing = items();
  const auto found = std::ranges::find(standing, item, &SceneItem::id);
  if (found == standing.end()) return refuse("item " + std::to_string(item) + " does not stand in the scene");
  const Tool& tool = tools_->find(found->tool)->tool;
  if (is_guide(tool) && found->seated) return refuse("\"" + tool.name + "\" is fixed by pins; draw a pin first");
  RoomEvent event = begin_event(EventKind::scene, by, {.item = item});
  items_[item].push_back({event.room_seq, std::nullopt});
  event.item = item;
  event.scene = true;
  finish_event(event);
  return event;
}

}  // namespace osteon
