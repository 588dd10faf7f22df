#include "haptic_client/control/replica.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace osteon::haptic {

Replica::Replica(const Case& bone, BodyId body) : body_(body), committed_(bone, body), predicted_(bone, body) {}

void Replica::restore(const FieldLeaf& leaf) {
  committed_.restore(leaf);
  predicted_.restore(leaf);
  changes_.push_back({leaf.level, {leaf.origin}});
}

void Replica::add_own(const Cut& cut) {
  last_own_ = std::max(last_own_, cut.author_seq);
  CutReport report = predicted_.apply(cut);
  pending_.push_back({cut, report.changed_leaves});
  if (!report.changed_leaves.empty()) changes_.push_back({report.level, std::move(report.changed_leaves)});
}

void Replica::commit(RoomSeq place, const Cut& cut, bool own) {
  room_seq_ = place;
  committed_.apply(cut);
  if (own) {
    // The prediction holds it already: applying it again would change nothing.
    const auto found = std::ranges::find(pending_, cut.author_seq, [](const Pending& p) { return p.cut.author_seq; });
    if (found != pending_.end()) {
      pending_.erase(found);
      return;
    }
  }
  CutReport report = predicted_.apply(cut);
  if (!report.changed_leaves.empty()) changes_.push_back({report.level, std::move(report.changed_leaves)});
}

void Replica::reject(RoomSeq place, std::uint64_t author_seq) {
  room_seq_ = std::max(room_seq_, place);
  ++rejected_;
  const auto found = std::ranges::find(pending_, author_seq, [](const Pending& p) { return p.cut.author_seq; });
  if (found == pending_.end()) return;
  if (!found->changed.empty()) undone_.push_back({found->cut.level, std::move(found->changed)});
  pending_.erase(found);
}

void Replica::settle() {
  if (undone_.empty()) return;
  std::array<float, kLeafVoxels> values;
  for (ChangedLeaves& undone : undone_) {
    for (const Coord origin : undone.origins) {
      committed_.gather_cuts(undone.level, {origin, origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}}, values);
      FieldLeaf leaf{body_, undone.level, origin, std::vector<std::int16_t>(kLeafVoxels)};
      std::ranges::transform(values, leaf.values.begin(), [](float mm) { return static_cast<std::int16_t>(std::lround(mm / kQuantum_mm)); });
      predicted_.restore(leaf);
    }
    changes_.push_back(std::move(undone));
  }
  undone_.clear();
  // A pending cut may have found its bone gone already, by one that was rejected: now it is the one that takes it.
  for (Pending& pending : pending_) {
    ++cut_again_;
    const CutReport report = predicted_.apply(pending.cut);
    std::vector<Coord> all;
    std::ranges::set_union(pending.changed, report.changed_leaves, std::back_inserter(all));
    pending.changed = std::move(all);
  }
}

std::vector<ChangedLeaves> Replica::take_changes() { return std::exchange(changes_, {}); }

}  // namespace osteon::haptic
