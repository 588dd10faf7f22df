// How log entries change a room. It is the same for a new entry and for one of a journal, years later.
#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <string>

#include "common/field/kernel.hpp"
#include "server/room/room.hpp"

namespace osteon {
namespace {

// Key, in a piece's history, of the mask that leaves only the piece of its parent. It is no event of its own. Sequence
// numbers stay below it.
constexpr std::uint64_t kLeftOfSplit = std::uint64_t{1} << 63;

// Longest life of a room, far from where times overflow.
constexpr std::chrono::nanoseconds kLongest = std::chrono::hours(24 * 365 * 100);

tl::unexpected<Error> impossible(const LogEntry& entry, const std::string& why) {
  return failure(ErrorCode::invalid_input, "entry " + std::to_string(entry.seq.value) + " cannot follow: " + why);
}

CoordBox level_0_box(int level, Coord origin) {
  return {shift_down(origin, level), shift_down(origin + Coord{kLeafSize, kLeafSize, kLeafSize}, level)};
}

bool meet(const CoordBox& a, const CoordBox& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y && a.min.z <= b.max.z &&
         b.min.z <= a.max.z;
}

// Where anything of a bone can be, in samples of level 0. A piece's masks reach one leaf and the band beyond the bone.
CoordBox about(const Case& bone) { return bone.bounds_samples().grown(2 * kLeafSize); }

// Whether a split may have this mask: sorted leaves of the lattice, near the bone, that hold values.
bool is_mask(const Mask& mask, const CoordBox& about) {
  if (!mask) return false;
  const auto position_of = [](const FieldLeaf& leaf) { return std::pair(leaf.level, leaf.origin); };
  for (std::size_t i = 0; i < mask->size(); ++i) {
    const FieldLeaf& leaf = (*mask)[i];
    const auto off_lattice = [](std::int32_t at) { return at % kLeafSize != 0; };
    if (leaf.level < 0 || leaf.level >= kLevels || !leaf.holds_values() || off_lattice(leaf.origin.x) ||
        off_lattice(leaf.origin.y) || off_lattice(leaf.origin.z) ||
        !about.contains(shift_down(leaf.origin, leaf.level)))
      return false;
    if (i > 0 && !(position_of((*mask)[i - 1]) < position_of(leaf))) return false;
  }
  return true;
}

void add(Hasher& hasher, const Digest& digest) { hasher.bytes(std::as_bytes(std::span(digest.bytes))); }

}  // namespace

Result<void> Room::replay(const LogEntry& entry, Fields fields) {
  if (Result<void> possible = can_follow(entry); !possible) return possible;
  set_time(entry.at);
  fields_ = fields;
  apply(entry);
  fields_ = Fields::evaluate;
  return {};
}

// Checks whether the entry is possible, not whether the room would decide it again. A damaged or forged journal may
// name what does not exist.
Result<void> Room::can_follow(const LogEntry& entry) const {
  const auto possible = [&](bool holds, const char* why) -> Result<void> {
    return holds ? Result<void>{} : Result<void>(impossible(entry, why));
  };
  if (entry.seq.value != room_seq_.value + 1)
    return impossible(entry, "entry " + std::to_string(room_seq_.value + 1) + " comes next");
  if (entry.at < now_ || entry.at > kLongest)
    return impossible(entry, "its time does not follow that of the entry before it");
  struct Judge {
    const Room& room;
    const LogEntry& entry;
    const decltype(possible)& require;

    Result<void> next_of(AuthorId author, std::uint64_t author_seq) const {
      if (!room.surgeons_.contains(author)) return require(false, "its author may not cut");
      return require(author_seq == room.decided(author) + 1, "it is not its author's next cut");
    }
    Result<void> operator()(const JoinEntry& join) const {
      return require(join.author.value == room.authors_ + 1 && join.kind <= MemberKind::watcher &&
                         static_cast<int>(join.role) < kRoles,
                     "an author was given twice");
    }
    Result<void> operator()(const CutEntry& cut) const {
      if (Result<void> next = next_of(cut.cut.author, cut.cut.author_seq); !next) return next;
      return require(room.exists(cut.cut.body) && room.judge_form(cut.cut) == Rejection::none,
                     "no room would take this cut");
    }
    Result<void> operator()(const RejectionEntry& one) const {
      if (Result<void> next = next_of(one.author, one.author_seq); !next) return next;
      return require(one.reason > Rejection::none && static_cast<int>(one.reason) < kRejections, "its reason is none");
    }
    Result<void> operator()(const SplitEntry& split) const {
      const CoordBox box = about(room.bone());
      bool whole = room.exists(split.parent) && is_mask(split.taken, box);
      std::uint32_t next = room.last_body_;
      for (const SplitPiece& piece : split.pieces)
        whole = whole && piece.body.value == ++next && is_mask(piece.left, box) && box.contains(piece.reach.min) &&
                box.contains(piece.reach.max);
      return require(whole && room.bodies().size() + split.pieces.size() <= kMostBodies, "the split is incomplete");
    }
    Result<void> operator()(const UndoEntry& undo) const {
      bool all = !undo.seqs.empty() && std::ranges::is_sorted(undo.seqs, std::less_equal{});
      for (const RoomSeq seq : undo.seqs) all = all && room.can_be_undone(seq) && !room.events_.at(seq).undone;
      return require(all, "it takes back what does not stand");
    }
    Result<void> operator()(const RedoEntry& redo) const {
      const auto stands = [&](RoomSeq seq) {
        const auto found = room.events_.find(seq);
        return found != room.events_.end() && found->second.kind == EventKind::undo && !found->second.undone;
      };
      // Newest undo first, oldest event first, no duplicates.
      bool all = !redo.undos.empty() && std::ranges::all_of(redo.undos, stands) &&
                 std::ranges::is_sorted(redo.undos, std::greater_equal{}) &&
                 std::ranges::is_sorted(redo.seqs, std::less_equal{});
      for (const RoomSeq seq : redo.seqs) all = all && room.can_be_undone(seq) && room.events_.at(seq).undone;
      return require(all, "it does again what was not undone");
    }
    Result<void> operator()(const RemoveBodyEntry& removal) const {
      return require(room.exists(removal.body) && room.bodies().size() > 1, "the body cannot go");
    }
    Result<void> operator()(const ItemEntry& item) const {
      const bool known = room.items_.contains(item.item);
      if (!item.set) return require(known, "there is no such item");
      const bool room_for_it = known || (item.item == room.last_item_ + 1 && room.items_.size() < kMostItems);
      return require(room_for_it && item.set->id == item.item && item.set->set_at == entry.seq.value &&
                         room.exists(item.set->body) && room.tools_->find(item.set->tool),
                     "the item cannot stand there");
    }
    Result<void> operator()(const ToolEntry& tool) const {
      if (room.tools_->find(tool.tool.hash())) return require(false, "the tool was known before");
      if (Result<void> room_for_it = room.know(tool.tool); !room_for_it)
        return impossible(entry, room_for_it.error().message);
      return {};
    }
    Result<void> operator()(const MarkEntry& mark) const {
      return require(!mark.label.empty() && mark.label.size() <= kMostLabelBytes, "the mark has no label");
    }
    Result<void> operator()(const SuperviseEntry& one) const {
      const Restrictions& set = one.supervision;
      bool all = room.surgeons_.contains(one.subject) && check(set).has_value();
      for (const AuthorId named : {set.taken_by, set.guide})
        all = all && (!named || (room.knows(named) && named != one.subject));
      for (const Digest& tool : set.tools) all = all && room.tools_->find(tool);
      return require(all, "it supervises what is not there");
    }
    Result<void> operator()(const AnnotationEntry& one) const {
      const auto& drawn = room.people_.annotations();
      if (!one.drawn) return require(drawn.contains(one.id), "there is no such annotation");
      const bool room_for_it =
          drawn.contains(one.id) || (one.id == room.people_.last_annotation() + 1 && drawn.size() < kMostAnnotations);
      return require(
          room_for_it && one.drawn->id == one.id && room.knows(one.drawn->author) && check(*one.drawn).has_value(),
          "the annotation cannot be there");
    }
    Result<void> operator()(const WordsEntry& said) const {
      return require(!said.words.empty() && said.words.size() <= kMostWordsBytes && (!said.to || room.knows(said.to)),
                     "nobody can have said it");
    }
  };
  return std::visit(Judge{*this, entry, possible}, entry.what);
}

RoomEvent Room::apply(const LogEntry& entry) {
  room_seq_ = entry.seq;
  RoomEvent event;
  event.room_seq = entry.seq;
  event.author = entry.author;
  std::visit([&](const auto& what) { apply(entry, what, event); }, entry.what);
  finish_event(event);
  return event;
}

void Room::finish_event(RoomEvent& event) const { event.bodies = bodies(); }

Room::Event& Room::add_event(const LogEntry& entry, EventKind kind) {
  Event& event = events_[entry.seq];
  event.kind = kind;
  event.author = entry.author;
  event.at = entry.at;
  return event;
}

void Room::apply(const LogEntry& entry, const JoinEntry& join, RoomEvent& event) {
  event.kind = EventKind::join;
  event.author = join.author;
  authors_ = join.author.value;
  secrets_[join.author] = join.secret;
  people_.join(join.author, join.role, join.person, join.kind == MemberKind::surgeon);
  if (join.kind == MemberKind::surgeon) surgeons_[join.author].granted = entry.at;
}

void Room::apply(const LogEntry& entry, const CutEntry& what, RoomEvent& event) {
  const Cut& cut = what.cut;
  event.kind = EventKind::cut;
  add_event(entry, EventKind::cut);
  ++counts_.committed;
  note_decided(cut.author, cut_digest(cut), entry.seq, Rejection::none);
  Surgeon& surgeon = surgeons_.at(cut.author);
  surgeon.claimed += std::chrono::microseconds(cut.path_us);
  surgeon.swept_voxels = voxels_spent(surgeon) + swept_voxels(cut);
  surgeon.spent = entry.at;

  event.cut.level = cut.level;
  for (auto& [id, body] : bodies_) {
    if (fields_ == Fields::leave) {
      if (const std::vector<Coord> reach = body.field.reach(cut); !reach.empty())
        body.history.add(entry.seq, cut, reach);
      continue;
    }
    CutReport part = body.field.apply(cut);
    if (!part.reached_leaves.empty()) body.history.add(entry.seq, cut, part.reached_leaves);
    if (!body.present) continue;  // nobody sees it, but it may come back
    event.cut.visited += part.visited;
    event.cut.computed += part.computed;
    event.cut.modified += part.modified;
    event.cut.changed_leaves.insert(event.cut.changed_leaves.end(), part.changed_leaves.begin(),
                                    part.changed_leaves.end());
    if (!part.changed_leaves.empty()) note_changed(id, {{cut.level, std::move(part.changed_leaves)}}, nullptr);
  }
  if (std::ranges::none_of(bodies_, [&](const auto& body) { return body.second.history.contains(entry.seq); }))
    events_.at(entry.seq).missed = std::make_shared<const Cut>(cut);
}

// A rejected cut also voids what its author has predicted on top of it. But a stale cut shows that the author does not
// know of the new epoch yet. Raising the epoch again would make the next cuts stale as well.
void Room::apply(const LogEntry& entry, const RejectionEntry& rejection, RoomEvent& event) {
  event.kind = EventKind::cut;
  ++counts_.rejected;
  note_decided(rejection.author, rejection.bytes, entry.seq, rejection.reason);
  if (rejection.reason == Rejection::lease) return;
  grant(surgeons_.at(rejection.author));
}

// Epochs are sequence numbers, so none repeats and everyone sees the same.
void Room::grant(Surgeon& surgeon) {
  surgeon.epoch = room_seq_.value + 1;
  surgeon.granted = now_;
  surgeon.claimed = {};
}

void Room::bone_came_back(RoomEvent& event) {
  ++bone_epoch_;
  ++bone_changes_;
  for (auto& [author, surgeon] : surgeons_) grant(surgeon);
  event.lease_epoch = room_seq_.value + 1;
}

void Room::apply(const LogEntry& entry, const UndoEntry& undo, RoomEvent& event) {
  event.kind = EventKind::undo;
  const bool all_of_others = takes_all_of_others(entry.author, {undo.seqs.begin(), undo.seqs.end()});
  Event& added = add_event(entry, EventKind::undo);
  added.seqs = undo.seqs;
  added.all_of_others = all_of_others;
  event.seqs = undo.seqs;
  std::set<BodyId> back;
  for (auto seq = undo.seqs.rbegin(); seq != undo.seqs.rend(); ++seq) {
    Event& fallen = events_.at(*seq);
    fallen.undone = true;
    event.scene |=
        fallen.kind == EventKind::scene || fallen.kind == EventKind::split || fallen.kind == EventKind::remove_body;
    event.bone |= fallen.kind != EventKind::scene;
    for (const SplitPiece& piece : fallen.pieces) {
      bodies_.erase(piece.body);
      back.erase(piece.body);
    }
    if (fallen.kind != EventKind::remove_body) continue;
    const auto body = bodies_.find(fallen.body);
    if (body == bodies_.end()) continue;
    body->second.present = true;
    back.insert(fallen.body);
  }
  for (auto& [id, body] : bodies_) {
    if (fields_ == Fields::leave) {
      body.history.note_undone(undo.seqs, true);
      continue;
    }
    const auto changed = body.history.undo(body.field, undo.seqs);
    if (body.present && !back.contains(id)) note_changed(id, changed, &event);
  }
  for (const BodyId id : back) show_whole(id, event);
  if (event.bone) bone_came_back(event);
}

void Room::apply(const LogEntry& entry, const RedoEntry& redo, RoomEvent& event) {
  event.kind = EventKind::redo;
  add_event(entry, EventKind::redo);
  for (const RoomSeq undo : redo.undos) events_.at(undo).undone = true;
  // Cuts first: a piece is made from its parent with all of them applied.
  std::vector<RoomSeq> cuts;
  for (const RoomSeq seq : redo.seqs)
    if (events_.at(seq).kind == EventKind::cut) cuts.push_back(seq);
  for (auto& [id, body] : bodies_) {
    if (fields_ == Fields::leave) {
      body.history.note_undone(cuts, false);
      continue;
    }
    const auto changed = body.history.redo(body.field, cuts);
    if (body.present) note_changed(id, changed, &event);
  }
  for (const RoomSeq seq : redo.seqs) {
    Event& again = events_.at(seq);
    if ((again.kind == EventKind::split || again.kind == EventKind::remove_body) && !exists(again.body)) continue;
    again.undone = false;
    event.seqs.push_back(seq);
    event.scene |=
        again.kind == EventKind::scene || again.kind == EventKind::split || again.kind == EventKind::remove_body;
    event.bone |= again.kind != EventKind::scene;
    if (again.kind == EventKind::split) cut_apart(seq, again, event);
    if (again.kind == EventKind::remove_body) bodies_.at(again.body).present = false;
  }
  if (event.bone) bone_came_back(event);
  // A body that was changed and then removed again is not reported.
  std::erase_if(event.leaves, [&](const FieldLeaf& leaf) { return !exists(leaf.body); });
}

void Room::apply(const LogEntry& entry, const RemoveBodyEntry& removal, RoomEvent& event) {
  event.kind = EventKind::remove_body;
  add_event(entry, EventKind::remove_body).body = removal.body;
  bodies_.at(removal.body).present = false;
  ++bone_changes_;
  event.bone = event.scene = true;
}

void Room::apply(const LogEntry& entry, const SplitEntry& split, RoomEvent& event) {
  event.kind = EventKind::split;
  Event& one = add_event(entry, EventKind::split);
  one.body = split.parent;
  one.taken = split.taken;
  one.pieces = split.pieces;
  if (!split.pieces.empty()) last_body_ = split.pieces.back().body.value;
  for (const SplitPiece& piece : split.pieces) last_body_ = std::max(last_body_, piece.body.value);
  cut_apart(entry.seq, one, event);
  event.scene = true;
  ++bone_changes_;
}

void Room::apply(const LogEntry& entry, const ItemEntry& item, RoomEvent& event) {
  event.kind = EventKind::scene;
  add_event(entry, EventKind::scene).item = item.item;
  items_[item.item].push_back({entry.seq, item.set});
  last_item_ = std::max(last_item_, item.item);
  event.item = item.item;
  event.scene = true;
}

void Room::apply(const LogEntry& entry, const ToolEntry& tool, RoomEvent& event) {
  event.kind = EventKind::tool;
  add_event(entry, EventKind::tool);
  event.tool = &tools_->add(tool.tool);
}

void Room::apply(const LogEntry& entry, const MarkEntry& mark, RoomEvent& event) {
  event.kind = EventKind::mark;
  add_event(entry, EventKind::mark).label = mark.label;
  event.mark = mark.label;
}

void Room::note_changed(BodyId id, const std::vector<LevelLeaves>& changed, RoomEvent* event) {
  Body& body = bodies_.at(id);
  for (const LevelLeaves& leaves : changed) {
    if (leaves.origins.empty()) continue;
    for (const BlockKey& key : body.surface.touch(leaves.level, leaves.origins)) stale_.insert(key);
    changes_[{id, leaves.level}].insert(leaves.origins.begin(), leaves.origins.end());
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

// Adds every leaf of a body that appears or comes back, and every block in which it may be drawn.
void Room::show_whole(BodyId id, RoomEvent& event) {
  Body& body = bodies_.at(id);
  std::vector<FieldLeaf> leaves = body.field.leaves();
  std::map<int, std::vector<Coord>> cut;
  for (const FieldLeaf& leaf : leaves)
    if (meet(level_0_box(leaf.level, leaf.origin), body.reach)) cut[leaf.level].push_back(leaf.origin);
  // Most of a piece's leaves are entirely empty and far from it. Only those round it are drawn.
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

// A copy of the parent with everything but the piece removed.
CutField Room::made_piece(const Body& parent, const SplitPiece& piece) const {
  CutField field(bone(), piece.body, tools_);
  for (const FieldLeaf& leaf : parent.field.leaves()) field.restore(leaf);
  for (const FieldLeaf& leaf : *piece.left) field.merge(leaf);
  return field;
}

// Applies what the parent lost since the copy from which the piece was made. Between a split and an undo, a field only
// loses bone.
void Room::catch_up(const Body& parent, CutField& field) const {
  FieldLeaf leaf;
  for (const auto& [place, origins] : changes_) {
    if (place.first != parent.field.body()) continue;
    for (const Coord origin : origins) {
      leaf.level = place.second;
      leaf.origin = origin;
      parent.field.read(leaf);
      field.merge(leaf);
    }
  }
}

// The pieces are copies of the parent, each with everything else removed. Then the parent loses them.
void Room::cut_apart(RoomSeq seq, Event& entry, RoomEvent& event) {
  Body& parent = bodies_.at(entry.body);
  const RoomSeq left_key{kLeftOfSplit | seq.value};
  const bool evaluated = fields_ == Fields::evaluate, ready = ready_.size() == entry.pieces.size();
  for (std::size_t i = 0; i < entry.pieces.size(); ++i) {
    const SplitPiece& piece = entry.pieces[i];
    const bool use = ready && ready_[i].body() == piece.body;
    if (use) catch_up(parent, ready_[i]);
    CutField field = use         ? std::move(ready_[i])
                     : evaluated ? made_piece(parent, piece)
                                 : CutField(bone(), piece.body, tools_);
    CutHistory history = parent.history.fork();
    history.add_mask(left_key, piece.left);
    add_body(piece.body, std::move(field), std::move(history), piece.reach);
  }
  std::vector<LevelLeaves> changed;
  const RoomSeq again[] = {seq};
  if (!parent.history.contains(seq)) {
    parent.history.add_mask(seq, entry.taken);
    std::map<int, std::vector<Coord>> origins;
    if (evaluated)
      for (const FieldLeaf& leaf : *entry.taken)
        if (parent.field.merge(leaf)) origins[leaf.level].push_back(leaf.origin);
    for (auto& [level, of_level] : origins) changed.push_back({level, std::move(of_level)});
  } else if (evaluated) {
    changed = parent.history.redo(parent.field, again);
  } else {
    parent.history.note_undone(again, false);
  }
  note_changed(entry.body, changed, &event);
  for (const SplitPiece& piece : entry.pieces) show_whole(piece.body, event);
  event.bone = true;
}

std::vector<FieldLeaf> Room::all_leaves() const {
  std::vector<FieldLeaf> leaves;
  for (const auto& [id, body] : bodies_) std::ranges::move(body.field.leaves(), std::back_inserter(leaves));
  return leaves;
}

Result<void> Room::set_fields(std::span<const FieldLeaf> leaves) {
  const CoordBox near = about(bone());
  for (const FieldLeaf& leaf : leaves)
    if (leaf.level < 0 || leaf.level >= kLevels || !leaf.holds_values() ||
        !near.contains(shift_down(leaf.origin, leaf.level)))
      return failure(ErrorCode::invalid_input, "the fields hold a leaf that does not belong to this bone");
  for (const FieldLeaf& leaf : leaves)
    if (!bodies_.contains(leaf.body))
      return failure(ErrorCode::invalid_input, "the fields hold leaves of body " + std::to_string(leaf.body.value) +
                                                   ", which the room does not have at event " +
                                                   std::to_string(room_seq_.value));
  for (const FieldLeaf& leaf : leaves) bodies_.at(leaf.body).field.restore(leaf);
  RoomEvent unsent;
  for (auto& [id, body] : bodies_)
    if (body.present) show_whole(id, unsent);
  return {};
}

Digest Room::room_hash() const {
  Hasher hasher;
  hasher.text("osteon-room-state-1");
  add(hasher, genesis_);
  hasher.integer(room_seq_.value);
  hasher.integer(bodies_.size());
  for (const auto& [id, body] : bodies_) {
    hasher.integer(id.value);
    hasher.integer(body.present ? 1 : 0);
    add(hasher, body.field.hash());
  }
  for (const auto& [id, states] : items_)
    for (const ItemState& state : states) {
      hasher.integer(id);
      hasher.integer(state.seq.value);
      hasher.integer(state.item ? 1 : 0);
      if (!state.item) continue;
      hasher.integer(state.item->body.value);
      add(hasher, state.item->tool);
      const Pose& pose = state.item->pose_bone_item;
      for (const double part : {pose.position_mm.x(), pose.position_mm.y(), pose.position_mm.z(), pose.rotation.x(),
                                pose.rotation.y(), pose.rotation.z(), pose.rotation.w(), state.item->turns})
        hasher.number(part);
      hasher.integer(state.item->seated ? 1 : 0);
    }
  for (const auto& [seq, event] : events_) {
    if (event.undone) hasher.integer(seq.value);  // tombstones
    if (event.kind == EventKind::mark) hasher.text(event.label);
  }
  hasher.integer(authors_);
  hasher.integer(bone_epoch_);
  for (const auto& [author, surgeon] : surgeons_) {
    hasher.integer(author.value);
    hasher.integer(surgeon.epoch);
    for (const Decided& entry : surgeon.decided) {
      add(hasher, entry.bytes);
      hasher.integer(entry.room_seq.value);
      hasher.integer(static_cast<std::uint64_t>(entry.rejection));
    }
  }
  people_.add_to(hasher);
  return hasher.finish();
}

}  // namespace osteon
