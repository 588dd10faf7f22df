#include "common/volume/replica.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace osteon {

Replica::Replica(const Case& bone, BodyId body, std::shared_ptr<const ToolBox> tools)
    : bone_(bone), tools_(std::move(tools)) {
  this->body(body);
}

Replica::Body& Replica::body(BodyId id) {
  const auto found = bodies_.find(id);
  if (found != bodies_.end()) return found->second;
  return bodies_.emplace(id, Body{CutField(bone_, id, tools_), CutField(bone_, id, tools_)}).first->second;
}

void Replica::restore(const FieldLeaf& leaf) {
  Body& held = body(leaf.body);
  held.committed.restore(leaf);
  held.predicted.restore(leaf);
  changes_.push_back({leaf.level, {leaf.origin}});
}

std::vector<Coord> Replica::predict(const Cut& cut) {
  std::vector<Coord> changed;
  for (auto& [id, held] : bodies_) {
    const CutReport report = held.predicted.apply(cut);
    std::vector<Coord> all;
    std::ranges::set_union(changed, report.changed_leaves, std::back_inserter(all));
    changed = std::move(all);
  }
  if (!changed.empty()) changes_.push_back({cut.level, changed});
  return changed;
}

void Replica::add_own(const Cut& cut) {
  last_own_ = std::max(last_own_, cut.author_seq);
  pending_.push_back({cut, predict(cut)});
}

void Replica::commit(RoomSeq seq, const Cut& cut, bool own) {
  // A repeated answer: the bone has had this cut, and may have lost it to an undo since.
  if (seq <= room_seq_) return;
  room_seq_ = seq;
  for (auto& [id, held] : bodies_) held.committed.apply(cut);
  if (own) {
    // The prediction contains it already: applying it again would change nothing.
    const auto found = std::ranges::find(pending_, cut.author_seq, [](const Pending& p) { return p.cut.author_seq; });
    if (found != pending_.end()) {
      if (again_) predict(cut);  // leaves that were set since do not contain it
      pending_.erase(found);
      return;
    }
  }
  predict(cut);
}

void Replica::fall(const Pending& pending) {
  for (const Coord origin : pending.changed) undone_.insert({pending.cut.level, origin});
}

bool Replica::reject(RoomSeq seq, std::uint64_t author_seq) {
  note(seq);
  ++rejected_;
  const auto found = std::ranges::find(pending_, author_seq, [](const Pending& p) { return p.cut.author_seq; });
  if (found == pending_.end()) return false;
  fall(*found);
  pending_.erase(found);
  return true;
}

void Replica::lease(std::uint64_t epoch) {
  std::erase_if(pending_, [&](const Pending& pending) {
    if (pending.cut.lease_epoch >= epoch) return false;
    fall(pending);
    return true;
  });
}

void Replica::renew(RoomSeq contained, std::span<const BodyId> bodies, std::span<const FieldLeaf> leaves,
                    std::uint64_t decided) {
  change(contained, bodies, {});
  room_seq_ = contained;
  std::map<BodyId, std::set<Place>> stored;
  for (const FieldLeaf& leaf : leaves) {
    stored[leaf.body].insert({leaf.level, leaf.origin});
    CutField& committed = body(leaf.body).committed;
    FieldLeaf held{leaf.body, leaf.level, leaf.origin, {}};
    committed.read(held);
    if (held == leaf) continue;
    committed.restore(leaf);
    undone_.insert({leaf.level, leaf.origin});
  }
  for (auto& [id, held] : bodies_)
    for (const FieldLeaf& leaf : held.committed.leaf_places()) {
      if (stored[id].contains({leaf.level, leaf.origin})) continue;
      held.committed.reset(leaf.level, leaf.origin);
      undone_.insert({leaf.level, leaf.origin});
    }
  std::erase_if(pending_, [&](const Pending& pending) {
    if (pending.cut.author_seq > decided) return false;
    fall(pending);  // what it removed is committed now, and is restored from there
    return true;
  });
}

void Replica::change(RoomSeq seq, std::span<const BodyId> bodies, std::span<const FieldLeaf> leaves) {
  note(seq);
  for (const BodyId id : bodies) {
    again_ |= !bodies_.contains(id);  // a new body does not contain the pending cuts
    body(id);
  }
  for (auto held = bodies_.begin(); held != bodies_.end();) {
    if (std::ranges::find(bodies, held->first) != bodies.end() || bodies.empty()) {
      ++held;
      continue;
    }
    for (const FieldLeaf& leaf : held->second.predicted.leaf_places()) changes_.push_back({leaf.level, {leaf.origin}});
    held = bodies_.erase(held);
  }
  for (const FieldLeaf& leaf : leaves) {
    restore(leaf);
    again_ = true;
  }
}

void Replica::settle() {
  if (undone_.empty() && !again_) return;
  std::map<int, std::vector<Coord>> back;
  for (const auto& [level, origin] : undone_) back[level].push_back(origin);
  for (auto& [level, origins] : back) {
    for (auto& [id, held] : bodies_)
      for (const Coord origin : origins) {
        FieldLeaf leaf{id, level, origin, {}};
        held.committed.read(leaf);
        held.predicted.restore(leaf);
      }
    changes_.push_back({level, std::move(origins)});
  }
  undone_.clear();
  again_ = false;
  // A dropped cut may have removed the bone before this pending cut did. Now the pending cut removes it.
  for (Pending& pending : pending_) {
    ++cut_again_;
    const std::vector<Coord> changed = predict(pending.cut);
    std::vector<Coord> all;
    std::ranges::set_union(pending.changed, changed, std::back_inserter(all));
    pending.changed = std::move(all);
  }
}

std::size_t Replica::drop_unconfirmed() {
  const std::size_t dropped = pending_.size();
  for (const Pending& pending : pending_) fall(pending);
  pending_.clear();
  settle();
  return dropped;
}

std::vector<ChangedLeaves> Replica::take_changes() { return std::exchange(changes_, {}); }

std::vector<const CutField*> Replica::bodies() const {
  std::vector<const CutField*> fields;
  for (const auto& [id, held] : bodies_) fields.push_back(&held.predicted);
  return fields;
}

Digest Replica::hash() const {
  std::vector<FieldLeaf> leaves;
  for (const CutField* field : bodies()) std::ranges::move(field->leaves(), std::back_inserter(leaves));
  return field_hash(std::move(leaves), bone_.pitch_mm());
}

double Replica::removed_mm3() const {
  // Each body lacks what was cut and what is in the other bodies.
  double removed_mm3 = -static_cast<double>(bodies_.size() - 1) * bone_.volume_mm3();
  for (const CutField* field : bodies()) removed_mm3 += field->removed_mm3();
  return removed_mm3;
}

}  // namespace osteon
