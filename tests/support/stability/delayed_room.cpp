#include "tests/support/stability/delayed_room.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace osteon::test {

DelayedRoom::DelayedRoom(const Case& bone, int delay_ticks) : delay_ticks_(delay_ticks), field_(bone, BodyId{}) {}

void DelayedRoom::say(Word word) { to_client_.push_back({now_ + delay_ticks_, RoomSeq{++room_seq_}, std::move(word)}); }

void DelayedRoom::send(const Cut& own) { to_room_.emplace_back(now_ + delay_ticks_, own); }

void DelayedRoom::commit_other(Cut cut) {
  cut.author = AuthorId{2};
  cut.author_seq = ++others_;
  field_.apply(cut);
  cuts_.push_back(cut);
  say(Committed{cut, false});
}

void DelayedRoom::undo(int count) {
  std::map<int, std::set<Coord>> touched;
  for (; count > 0 && !cuts_.empty(); --count, ++undone_) {
    for (const Coord& origin : field_.reach(cuts_.back())) touched[cuts_.back().level].insert(origin);
    cuts_.pop_back();
  }
  Changed changed{{}, ++epoch_};
  for (const auto& [level, origins] : touched) {
    const std::vector<Coord> leaves(origins.begin(), origins.end());
    for (const Coord& origin : leaves) field_.reset(level, origin);
    for (const Cut& cut : cuts_)
      if (cut.level == level) field_.apply_to(cut, leaves);
    for (const Coord& origin : leaves) {
      FieldLeaf leaf{BodyId{}, level, origin, {}};
      field_.read(leaf);
      changed.leaves.push_back(std::move(leaf));
    }
  }
  say(std::move(changed));
}

void DelayedRoom::tick(Replica& client) {
  ++now_;
  for (; !to_room_.empty() && to_room_.front().first <= now_; to_room_.pop_front()) {
    const Cut& cut = to_room_.front().second;
    if (cut.lease_epoch < epoch_) {
      say(Rejected{cut.author_seq});
      continue;
    }
    field_.apply(cut);
    cuts_.push_back(cut);
    say(Committed{cut, true});
  }
  for (; !to_client_.empty() && to_client_.front().due <= now_; to_client_.pop_front()) {
    const auto& [due, place, word] = to_client_.front();
    if (const auto* committed = std::get_if<Committed>(&word)) client.commit(place, committed->cut, committed->own);
    if (const auto* rejected = std::get_if<Rejected>(&word)) client.reject(place, rejected->author_seq);
    if (const auto* changed = std::get_if<Changed>(&word)) {
      client.change(place, std::vector{BodyId{}}, changed->leaves);
      client_epoch_ = changed->lease_epoch;
      client.lease(client_epoch_);
    }
  }
  client.settle();
}

}  // namespace osteon::test
