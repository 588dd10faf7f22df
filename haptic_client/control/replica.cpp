#include "haptic_client/control/replica.hpp"

#include <algorithm>

#include "common/field/kernel.hpp"

namespace osteon::haptic {

Replica::Replica(const Case& bone, BodyId body) : bone_(bone), body_(body), predicted_(bone, body) {}

void Replica::restore(const FieldLeaf& leaf) {
  joined_.push_back(leaf);
  predicted_.restore(leaf);
  changes_.push_back({leaf.level, {leaf.origin}});
}

void Replica::add_own(const Cut& cut) {
  pending_.push_back(cut);
  last_own_ = std::max(last_own_, cut.author_seq);
  CutReport report = predicted_.apply(cut);
  if (!report.changed_leaves.empty()) changes_.push_back({report.level, std::move(report.changed_leaves)});
}

void Replica::commit(RoomSeq place, const Cut& cut, bool own) {
  room_seq_ = place;
  committed_cuts_.push_back(cut);
  if (own) {
    // The prediction holds it already: applying it again would change nothing.
    const auto found = std::ranges::find(pending_, cut.author_seq, &Cut::author_seq);
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
  const auto found = std::ranges::find(pending_, author_seq, &Cut::author_seq);
  if (found == pending_.end()) return;
  changes_.push_back({found->level, SweptTool(*found, bone_.pitch_mm()).leaves()});
  pending_.erase(found);
  predicted_ = committed();
  for (const Cut& cut : pending_) predicted_.apply(cut);
}

CutField Replica::committed() const {
  CutField field(bone_, body_);
  for (const FieldLeaf& leaf : joined_) field.restore(leaf);
  for (const Cut& cut : committed_cuts_) field.apply(cut);
  return field;
}

std::vector<ChangedLeaves> Replica::take_changes() { return std::exchange(changes_, {}); }

}  // namespace osteon::haptic
