#include "common/volume/cut_history.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/core/check.hpp"

namespace osteon {
namespace {

void sort_and_unite(std::vector<Coord>& origins) {
  std::ranges::sort(origins);
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
}

auto place_in_body(const FieldLeaf& leaf) { return std::tuple(leaf.level, leaf.origin); }

}  // namespace

void CutHistory::add(RoomSeq seq, const Cut& cut, const std::vector<Coord>& leaves) {
  OSTEON_CHECK(!cut.path.empty() && cut.level >= 0 && cut.level < kLevels && !contains(seq));
  own_.events.emplace(seq, Event{cut, {}});
  for (const Coord origin : leaves) own_.reach[to_index(cut.level)][origin].push_back(seq);
}

void CutHistory::add_mask(RoomSeq seq, Mask mask) {
  OSTEON_CHECK(mask && !contains(seq));
  own_.events.emplace(seq, Event{{}, std::move(mask)});
}

void CutHistory::add_mask(RoomSeq seq, std::vector<FieldLeaf> mask) {
  std::ranges::sort(mask, {}, place_in_body);
  add_mask(seq, std::make_shared<const std::vector<FieldLeaf>>(std::move(mask)));
}

CutHistory CutHistory::fork() {
  if (!own_.events.empty()) shared_.push_back(std::make_shared<const Part>(std::exchange(own_, {})));
  return *this;
}

const CutHistory::Part* CutHistory::part_of(RoomSeq seq) const {
  if (own_.events.contains(seq)) return &own_;
  for (const auto& part : shared_)
    if (part->events.contains(seq)) return part.get();
  return nullptr;
}

bool CutHistory::contains(RoomSeq seq) const { return part_of(seq) != nullptr; }
bool CutHistory::undone(RoomSeq seq) const { return undone_.contains(seq); }

const Cut* CutHistory::find_cut(RoomSeq seq) const {
  const Part* part = part_of(seq);
  if (part == nullptr) return nullptr;
  const Cut& cut = part->events.at(seq).cut;
  return cut.path.empty() ? nullptr : &cut;
}

std::size_t CutHistory::size() const {
  std::size_t events = own_.events.size();
  for (const auto& part : shared_) events += part->events.size();
  return events;
}

std::vector<LevelLeaves> CutHistory::undo(CutField& field, std::span<const RoomSeq> seqs) {
  return rebuild(field, seqs, true);
}

std::vector<LevelLeaves> CutHistory::redo(CutField& field, std::span<const RoomSeq> seqs) {
  return rebuild(field, seqs, false);
}

void CutHistory::note_undone(std::span<const RoomSeq> seqs, bool undone) {
  for (const RoomSeq seq : seqs) {
    if (!contains(seq)) continue;
    if (undone)
      undone_.insert(seq);
    else
      undone_.erase(seq);
  }
}

// The leaves of a cut are not stored with it. A leaf lists its cuts already, and the cut's leaves follow from its path.
CutHistory::Leaves CutHistory::reached(const CutField& field, const Part& part, RoomSeq seq) {
  const Event& event = part.events.at(seq);
  Leaves leaves;
  if (event.cut.path.empty()) {
    for (const FieldLeaf& leaf : *event.mask) leaves[to_index(leaf.level)].push_back(leaf.origin);
    return leaves;
  }
  const auto& reach = part.reach[to_index(event.cut.level)];
  for (const Coord origin : field.reach(event.cut)) {
    const auto listed = reach.find(origin);
    if (listed != reach.end() && std::ranges::find(listed->second, seq) != listed->second.end())
      leaves[to_index(event.cut.level)].push_back(origin);
  }
  return leaves;
}

std::vector<LevelLeaves> CutHistory::rebuild(CutField& field, std::span<const RoomSeq> seqs, bool undone) {
  cost_ = {};
  Leaves touched;
  for (const RoomSeq seq : seqs) {
    const Part* part = part_of(seq);
    if (!part || this->undone(seq) == undone) continue;
    if (undone)
      undone_.insert(seq);
    else
      undone_.erase(seq);
    const Leaves leaves = reached(field, *part, seq);
    for (int level = 0; level < kLevels; ++level)
      touched[to_index(level)].insert(touched[to_index(level)].end(), leaves[to_index(level)].begin(),
                                      leaves[to_index(level)].end());
  }
  std::vector<FieldLeaf> before;
  for (int level = 0; level < kLevels; ++level) {
    sort_and_unite(touched[to_index(level)]);
    for (const Coord origin : touched[to_index(level)]) {
      before.push_back({field.body(), level, origin, {}});
      field.read(before.back());
      field.reset(level, origin);
    }
  }
  cost_.leaves = before.size();
  apply_again(field, touched);

  std::vector<LevelLeaves> changed;
  FieldLeaf after;
  after.body = field.body();
  for (const FieldLeaf& leaf : before) {
    after.level = leaf.level;
    after.origin = leaf.origin;
    field.read(after);
    if (after == leaf) continue;
    if (changed.empty() || changed.back().level != leaf.level) changed.push_back({leaf.level, {}});
    changed.back().origins.push_back(leaf.origin);
  }
  return changed;
}

void CutHistory::apply_again(CutField& field, const Leaves& leaves) {
  // Grouped by event, so that each path is prepared once.
  std::map<RoomSeq, std::pair<const Event*, Leaves>> work;
  std::vector<const Event*> masks;
  const auto add_part = [&](const Part& part) {
    for (int level = 0; level < kLevels; ++level)
      for (const Coord origin : leaves[to_index(level)]) {
        const auto listed = part.reach[to_index(level)].find(origin);
        if (listed == part.reach[to_index(level)].end()) continue;
        for (const RoomSeq seq : listed->second) {
          if (undone(seq)) continue;
          auto& [event, of_event] = work[seq];
          event = &part.events.at(seq);
          of_event[to_index(level)].push_back(origin);
        }
      }
    for (const auto& [seq, event] : part.events)
      if (event.mask && !undone(seq)) masks.push_back(&event);
  };
  for (const auto& part : shared_) add_part(*part);
  add_part(own_);
  for (const auto& [seq, one] : work) {
    const std::vector<Coord>& part = one.second[to_index(one.first->cut.level)];
    field.apply_to(one.first->cut, part);
    ++cost_.cuts;
    cost_.leaf_cuts += part.size();
  }
  for (const Event* event : masks)
    for (int level = 0; level < kLevels; ++level) {
      // Both are sorted, so one pass through the mask is enough.
      auto mask = event->mask->begin();
      for (const Coord origin : leaves[to_index(level)]) {
        mask = std::lower_bound(mask, event->mask->end(), std::tuple(level, origin),
                                [](const FieldLeaf& leaf, const auto& place) { return place_in_body(leaf) < place; });
        if (mask == event->mask->end()) break;
        if (place_in_body(*mask) != std::tuple(level, origin)) continue;
        field.merge(*mask);
        ++cost_.masks;
      }
    }
}

}  // namespace osteon
