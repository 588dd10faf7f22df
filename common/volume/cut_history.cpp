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
  OSTEON_CHECK(!cut.path.empty() && cut.level >= 0 && cut.level < kLevels);
  const bool added = events_.emplace(place, Event{cut, {}, false}).second;
  OSTEON_CHECK(added);
  for (const Coord origin : leaves) reach_[at(cut.level)][origin].push_back(place);
}

void CutHistory::add_mask(RoomSeq place, const std::vector<FieldLeaf>& mask) {
  Event event{{}, mask, false};
  std::ranges::sort(event.mask, {}, place_of);
  for (const FieldLeaf& leaf : mask) reach_[at(leaf.level)][leaf.origin].push_back(place);
  const bool added = events_.emplace(place, std::move(event)).second;
  OSTEON_CHECK(added);
}

bool CutHistory::contains(RoomSeq place) const { return events_.contains(place); }

bool CutHistory::undone(RoomSeq place) const {
  const auto event = events_.find(place);
  return event != events_.end() && event->second.undone;
}

std::vector<LevelLeaves> CutHistory::undo(CutField& field, std::span<const RoomSeq> places) {
  return rebuild(field, places, true);
}

std::vector<LevelLeaves> CutHistory::redo(CutField& field, std::span<const RoomSeq> places) {
  return rebuild(field, places, false);
}

// The leaves of an event are not kept beside it: a leaf lists its events already, and a cut's own follow from its path.
CutHistory::Leaves CutHistory::reached(const CutField& field, const Event& event, RoomSeq place) const {
  Leaves leaves;
  if (event.cut.path.empty()) {
    for (const FieldLeaf& leaf : event.mask) leaves[at(leaf.level)].push_back(leaf.origin);
    return leaves;
  }
  const auto& reach = reach_[at(event.cut.level)];
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
    const auto found = events_.find(place);
    if (found == events_.end() || found->second.undone == undone) continue;
    found->second.undone = undone;
    const Leaves leaves = reached(field, found->second, place);
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
  for (const FieldLeaf& leaf : before) {
    after.level = leaf.level;
    after.origin = leaf.origin;
    field.read(after);
    if (after.values == leaf.values) continue;
    if (changed.empty() || changed.back().level != leaf.level) changed.push_back({leaf.level, {}});
    changed.back().origins.push_back(leaf.origin);
  }
  return changed;
}

void CutHistory::apply_again(CutField& field, const Leaves& leaves) {
  // By event, so that each path is prepared once.
  std::map<RoomSeq, Leaves> work;
  for (int level = 0; level < kLevels; ++level)
    for (const Coord origin : leaves[at(level)])
      for (const RoomSeq place : reach_[at(level)].at(origin))
        if (!events_.at(place).undone) work[place][at(level)].push_back(origin);
  for (const auto& [place, parts] : work) {
    const Event& event = events_.at(place);
    if (!event.cut.path.empty()) {
      const std::vector<Coord>& part = parts[at(event.cut.level)];
      field.apply_to(event.cut, part);
      ++cost_.cuts;
      cost_.leaf_cuts += part.size();
      continue;
    }
    for (int level = 0; level < kLevels; ++level)
      for (const Coord origin : parts[at(level)]) {
        const auto mask = std::ranges::lower_bound(event.mask, std::tuple(level, origin), {}, place_of);
        OSTEON_CHECK(mask != event.mask.end() && mask->origin == origin && mask->level == level);
        field.merge(*mask);
        ++cost_.masks;
      }
  }
}

}  // namespace osteon
