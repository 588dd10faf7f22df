#include "common/volume/cut_history.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/core/check.hpp"

namespace osteon {
namespace {

std::size_t at(int level) { return static_cast<std::size_t>(level); }

void sort_and_unite(std::vector<Coord>& origins) {
  std::ranges::sort(origins);
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
}

auto place_of(const FieldLeaf& leaf) { return std::tuple(leaf.level, leaf.origin); }

}  // namespace

void CutHistory::add(RoomSeq place, const Cut& cut, const std::vector<Coord>& leaves) {
  OSTEON_CHECK(!cut.path.empty() && cut.level >= 0 && cut.level < kLevels && !contains(place));
  own_.events.emplace(place, Event{cut, {}});
  for (const Coord origin : leaves) own_.reach[at(cut.level)][origin].push_back(place);
}

void CutHistory::add_mask(RoomSeq place, Mask mask) {
  OSTEON_CHECK(mask && !contains(place));
  own_.events.emplace(place, Event{{}, std::move(mask)});
}

void CutHistory::add_mask(RoomSeq place, std::vector<FieldLeaf> mask) {
  std::ranges::sort(mask, {}, place_of);
  add_mask(place, std::make_shared<const std::vector<FieldLeaf>>(std::move(mask)));
}

CutHistory CutHistory::fork() {
  if (!own_.events.empty()) shared_.push_back(std::make_shared<const Part>(std::exchange(own_, {})));
  return *this;
}

const CutHistory::Part* CutHistory::part_of(RoomSeq place) const {
  if (own_.events.contains(place)) return &own_;
  for (const auto& part : shared_)
    if (part->events.contains(place)) return part.get();
  return nullptr;
}

bool CutHistory::contains(RoomSeq place) const { return part_of(place) != nullptr; }
bool CutHistory::undone(RoomSeq place) const { return undone_.contains(place); }

const Cut* CutHistory::find_cut(RoomSeq place) const {
  const Part* part = part_of(place);
  if (part == nullptr) return nullptr;
  const Cut& cut = part->events.at(place).cut;
  return cut.path.empty() ? nullptr : &cut;
}

std::size_t CutHistory::size() const {
  std::size_t events = own_.events.size();
  for (const auto& part : shared_) events += part->events.size();
  return events;
}

std::vector<LevelLeaves> CutHistory::undo(CutField& field, std::span<const RoomSeq> places) {
  return rebuild(field, places, true);
}

std::vector<LevelLeaves> CutHistory::redo(CutField& field, std::span<const RoomSeq> places) {
  return rebuild(field, places, false);
}

void CutHistory::note_undone(std::span<const RoomSeq> places, bool undone) {
  for (const RoomSeq place : places) {
    if (!contains(place)) continue;
    if (undone)
      undone_.insert(place);
    else
      undone_.erase(place);
  }
}

// The leaves of a cut are not kept beside it: a leaf lists its cuts already, and a cut's own follow from its path.
CutHistory::Leaves CutHistory::reached(const CutField& field, const Part& part, RoomSeq place) {
  const Event& event = part.events.at(place);
  Leaves leaves;
  if (event.cut.path.empty()) {
    for (const FieldLeaf& leaf : *event.mask) leaves[at(leaf.level)].push_back(leaf.origin);
    return leaves;
  }
  const auto& reach = part.reach[at(event.cut.level)];
  for (const Coord origin : field.reach(event.cut)) {
    const auto listed = reach.find(origin);
    if (listed != reach.end() && std::ranges::find(listed->second, place) != listed->second.end())
      leaves[at(event.cut.level)].push_back(origin);
  }
  return leaves;
}

std::vector<LevelLeaves> CutHistory::rebuild(CutField& field, std::span<const RoomSeq> places, bool undone) {
  cost_ = {};
  Leaves touched;
  for (const RoomSeq place : places) {
    const Part* part = part_of(place);
    if (!part || this->undone(place) == undone) continue;
    if (undone)
      undone_.insert(place);
    else
      undone_.erase(place);
    const Leaves leaves = reached(field, *part, place);
    for (int level = 0; level < kLevels; ++level)
      touched[at(level)].insert(touched[at(level)].end(), leaves[at(level)].begin(), leaves[at(level)].end());
  }
  std::vector<FieldLeaf> before;
  for (int level = 0; level < kLevels; ++level) {
    sort_and_unite(touched[at(level)]);
    for (const Coord origin : touched[at(level)]) {
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
  // By event, so that each path is prepared once.
  std::map<RoomSeq, std::pair<const Event*, Leaves>> work;
  std::vector<const Event*> masks;
  const auto add_part = [&](const Part& part) {
    for (int level = 0; level < kLevels; ++level)
      for (const Coord origin : leaves[at(level)]) {
        const auto listed = part.reach[at(level)].find(origin);
        if (listed == part.reach[at(level)].end()) continue;
        for (const RoomSeq place : listed->second) {
          if (undone(place)) continue;
          auto& [event, of_event] = work[place];
          event = &part.events.at(place);
          of_event[at(level)].push_back(origin);
        }
      }
    for (const auto& [place, event] : part.events)
      if (event.mask && !undone(place)) masks.push_back(&event);
  };
  for (const auto& part : shared_) add_part(*part);
  add_part(own_);
  for (const auto& [place, one] : work) {
    const std::vector<Coord>& part = one.second[at(one.first->cut.level)];
    field.apply_to(one.first->cut, part);
    ++cost_.cuts;
    cost_.leaf_cuts += part.size();
  }
  for (const Event* event : masks)
    for (int level = 0; level < kLevels; ++level) {
      // Both are sorted: one walk through the mask.
      auto mask = event->mask->begin();
      for (const Coord origin : leaves[at(level)]) {
        mask = std::lower_bound(mask, event->mask->end(), std::tuple(level, origin),
                                [](const FieldLeaf& leaf, const auto& place) { return place_of(leaf) < place; });
        if (mask == event->mask->end()) break;
        if (place_of(*mask) != std::tuple(level, origin)) continue;
        field.merge(*mask);
        ++cost_.masks;
      }
    }
}

}  // namespace osteon
