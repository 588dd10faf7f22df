#include "tests/simulation/ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

namespace osteon::test {
namespace {

std::string number(RoomSeq place) { return std::to_string(place.value); }

std::string whose(AuthorId author, std::uint64_t author_seq) {
  return "cut " + std::to_string(author_seq) + " of author " + std::to_string(author.value);
}

bool lies_in(const ZoneLimit& zone, const std::array<std::int32_t, 3>& tip) {
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) square += std::pow(double{1} * tip[axis] - zone.centre[axis], 2);
  return square <= std::pow(double{1} * zone.radius, 2);
}

std::optional<EventKind> kind_of(const RoomRow& row) {
  struct Kind {
    EventKind operator()(const JoinRow&) const { return EventKind::join; }
    EventKind operator()(const CutRow&) const { return EventKind::cut; }
    EventKind operator()(const RejectionRow&) const { return EventKind::cut; }
    EventKind operator()(const SplitRow&) const { return EventKind::split; }
    EventKind operator()(const UndoRow&) const { return EventKind::undo; }
    EventKind operator()(const RedoRow&) const { return EventKind::redo; }
    EventKind operator()(const RemoveBodyRow&) const { return EventKind::remove_body; }
    EventKind operator()(const ItemRow&) const { return EventKind::scene; }
    EventKind operator()(const ToolRow&) const { return EventKind::tool; }
    EventKind operator()(const MarkRow&) const { return EventKind::mark; }
    EventKind operator()(const SuperviseRow&) const { return EventKind::supervise; }
    EventKind operator()(const AnnotationRow&) const { return EventKind::annotation; }
    EventKind operator()(const WordsRow&) const { return EventKind::words; }
  };
  return std::visit(Kind{}, row.what);
}

}  // namespace

// Who has come with a hand, what holds for it, and what was cut.
struct Ledger::Hands {
  std::map<AuthorId, std::uint32_t> persons;  // of those that cut, in the order in which they came
  std::map<AuthorId, Restrictions> held;
  std::map<RoomSeq, const Cut*> cuts;

  [[nodiscard]] Restrictions of(AuthorId author) const {
    const auto found = held.find(author);
    return found == held.end() ? Restrictions{} : found->second;
  }
};

std::string_view name(Invariant invariant) {
  switch (invariant) {
    case Invariant::one_bone:
      return "one bone";
    case Invariant::set_of_cuts:
      return "set of cuts";
    case Invariant::acknowledged:
      return "acknowledged is kept";
    case Invariant::replay:
      return "replay is live";
    case Invariant::lease:
      return "lease";
    case Invariant::bounds:
      return "bounds";
    case Invariant::author_order:
      return "author order";
    case Invariant::felt:
      return "felt";
    case Invariant::decided:
      return "decided";
    case Invariant::served:
      return "served";
    case Invariant::datagrams:
      return "datagrams";
    case Invariant::overseen:
      return "overseen";
    case Invariant::settled:
      return "settled";
  }
  return "unknown";
}

void Ledger::fault(Invariant invariant, std::string sentence) {
  constexpr std::size_t kEnough = 20;
  if (faults_.size() < kEnough) faults_.push_back({invariant, std::move(sentence)});
}

void Ledger::made(const Cut& cut, std::chrono::nanoseconds now) {
  made_[cut.author].push_back(cut);
  made_at_[cut.author].push_back(now);
}

std::optional<std::chrono::nanoseconds> Ledger::age(const Cut& cut, std::chrono::nanoseconds now) const {
  const auto made = made_at_.find(cut.author);
  if (made == made_at_.end() || cut.author_seq == 0 || cut.author_seq > made->second.size()) return {};
  return now - made->second[cut.author_seq - 1];
}

void Ledger::told(RoomSeq place, const Told& what) {
  told_up_to(place);
  const auto [at, first] = told_.emplace(place, what);
  check(first || at->second == what, Invariant::acknowledged,
        "place " + number(place) + " was told twice, as different events");
}

void Ledger::told_committed(RoomSeq place, const Cut& cut) {
  told(place, {EventKind::cut, false, cut.author, cut.author_seq, cut_digest(cut)});
}
void Ledger::told_rejected(RoomSeq place, AuthorId author, std::uint64_t author_seq) {
  told(place, {EventKind::cut, true, author, author_seq, {}});
}
void Ledger::told_event(RoomSeq place, EventKind kind) { told(place, {kind, false, {}, 0, {}}); }
void Ledger::told_up_to(RoomSeq place) {
  check(place <= kept_, Invariant::acknowledged,
        "place " + number(place) + " was told while the rows were kept up to " + number(kept_));
  furthest_ = std::max(furthest_, place);
}
void Ledger::told_decided(AuthorId author, std::uint64_t author_seq) {
  std::uint64_t& newest = decided_[author];
  newest = std::max(newest, author_seq);
}

void Ledger::told_place(RoomSeq place, AuthorId author, std::uint64_t author_seq) {
  const std::vector<Cut>& own = made_[author];
  if (author_seq == 0 || author_seq > own.size())
    return fault(Invariant::acknowledged, whose(author, author_seq) + " has a place, and was never made");
  if (place)
    told_committed(place, own[author_seq - 1]);
  else
    rejected_.emplace(author, author_seq);
}

void Ledger::check_author(const RoomRow& row, AuthorId author, std::uint64_t author_seq, const Digest& bytes,
                          std::map<AuthorId, std::uint64_t>& newest) {
  const std::uint64_t next = ++newest[author];
  check(author_seq == next, Invariant::author_order,
        "row " + number(row.place) + " is " + whose(author, author_seq) + ", where " + std::to_string(next) +
            " comes next");
  const std::vector<Cut>& own = made_[author];
  if (author_seq == 0 || author_seq > own.size())
    return fault(Invariant::author_order,
                 "row " + number(row.place) + " is " + whose(author, author_seq) + ", who never made it");
  check(cut_digest(own[author_seq - 1]) == bytes, Invariant::author_order,
        "row " + number(row.place) + " is " + whose(author, author_seq) + ", with other bytes than he made");
}

void Ledger::check_held(const RoomRow& row, const Hands& hands) {
  const bool changes = std::holds_alternative<UndoRow>(row.what) || std::holds_alternative<RedoRow>(row.what) ||
                       std::holds_alternative<ItemRow>(row.what) || std::holds_alternative<RemoveBodyRow>(row.what);
  const Restrictions now = hands.of(row.author);
  check(!changes || (!now.stopped && now.taken_by == AuthorId{}), Invariant::overseen,
        "row " + number(row.place) + " is what author " + std::to_string(row.author.value) + " did while held");
  const auto* redo = std::get_if<RedoRow>(&row.what);
  if (redo == nullptr) return;
  for (const RoomSeq place : redo->places)
    if (const auto cut = hands.cuts.find(place); cut != hands.cuts.end())
      check_cut(row, hands, row.author, *cut->second);
}

void Ledger::check_cut(const RoomRow& row, const Hands& hands, AuthorId by, const Cut& cut) {
  const Restrictions now = hands.of(by);
  const auto forbidden = [&](const std::string& why) {
    fault(Invariant::overseen, "row " + number(row.place) + " has " + whose(cut.author, cut.author_seq) +
                                   ", and author " + std::to_string(by.value) + " " + why);
  };
  if (now.stopped) forbidden("was stopped");
  if (now.taken_by != AuthorId{}) forbidden("had no tool");
  if (!now.tools.empty() && std::ranges::find(now.tools, cut.tool) == now.tools.end())
    forbidden("might not cut with that tool");
  if (!now.zone) return;
  for (const QuantisedPose& knot : cut.path)
    if (!lies_in(*now.zone, knot.position)) return forbidden("might not cut there");
}

// Whoever starts their program again is held as they were, from the next row on.
void Ledger::check_carried(std::span<const RoomRow> rows, std::size_t join, Hands& hands) {
  const auto& joined = std::get<JoinRow>(rows[join].what);
  Restrictions before;
  for (const auto& [author, person] : hands.persons)
    if (person != 0 && person == joined.person) before = hands.of(author);
  hands.persons[joined.author] = joined.person;
  if (before == Restrictions{}) return;
  const auto* next = join + 1 < rows.size() ? std::get_if<SuperviseRow>(&rows[join + 1].what) : nullptr;
  check(next != nullptr && next->subject == joined.author && next->supervision == before, Invariant::overseen,
        "row " + number(rows[join].place) + " lets a person's new hand go, author " +
            std::to_string(joined.author.value));
}

void Ledger::check_rows(std::span<const RoomRow> rows) {
  if (furthest_.value > rows.size())
    fault(Invariant::acknowledged, "the room was said to stand at " + number(furthest_) + ", and " +
                                       std::to_string(rows.size()) + " rows are kept");
  std::map<AuthorId, std::uint64_t> newest, lease;  // of the leases that are not 1
  std::map<RoomSeq, bool> of_bone;  // places of events that can be undone: whether bone comes back with them
  Hands hands;
  const auto lease_of = [&](AuthorId author) {
    const auto found = lease.find(author);
    return found == lease.end() ? std::uint64_t{1} : found->second;
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const RoomRow& row = rows[i];
    check(row.place.value == i + 1, Invariant::replay,
          "row " + std::to_string(i + 1) + " has the place " + number(row.place));
    Told kept{*kind_of(row), false, {}, 0, {}};
    bool bone_back = false;
    check_held(row, hands);
    if (const auto* cut = std::get_if<CutRow>(&row.what)) {
      const Digest bytes = cut_digest(cut->cut);
      kept = {EventKind::cut, false, cut->cut.author, cut->cut.author_seq, bytes};
      check_author(row, cut->cut.author, cut->cut.author_seq, bytes, newest);
      check(!rejected_.contains({cut->cut.author, cut->cut.author_seq}), Invariant::acknowledged,
            "row " + number(row.place) + " is a cut that was said to be rejected");
      check(cut->cut.lease_epoch == lease_of(cut->cut.author), Invariant::lease,
            "row " + number(row.place) + ", " + whose(cut->cut.author, cut->cut.author_seq) + ", is of lease " +
                std::to_string(cut->cut.lease_epoch) + " where " + std::to_string(lease_of(cut->cut.author)) +
                " holds");
      of_bone[row.place] = true;
      hands.cuts[row.place] = &cut->cut;
      check_cut(row, hands, cut->cut.author, cut->cut);
    } else if (const auto* rejection = std::get_if<RejectionRow>(&row.what)) {
      // All these hands are honest.
      check(rejection->reason != Rejection::time, Invariant::served,
            "row " + number(row.place) + " says that " + whose(rejection->author, rejection->author_seq) +
                " took longer than time has passed");
      kept = {EventKind::cut, true, rejection->author, rejection->author_seq, {}};
      check_author(row, rejection->author, rejection->author_seq, rejection->bytes, newest);
      if (rejection->reason == Rejection::lease) {
        const std::vector<Cut>& own = made_[rejection->author];
        check(rejection->author_seq <= own.size() &&
                  own[rejection->author_seq - 1].lease_epoch != lease_of(rejection->author),
              Invariant::lease, "row " + number(row.place) + " rejects a cut of the lease that holds");
      } else {
        lease[rejection->author] = row.place.value + 1;
      }
    } else if (const auto* join = std::get_if<JoinRow>(&row.what)) {
      lease[join->author] = 1;
      if (join->kind == MemberKind::surgeon) check_carried(rows, i, hands);
    } else if (const auto* decided = std::get_if<SuperviseRow>(&row.what)) {
      Restrictions& before = hands.held[decided->subject];
      const Restrictions& now = decided->supervision;
      if (before.stopped != now.stopped || before.taken_by != now.taken_by)
        lease[decided->subject] = row.place.value + 1;
      before = now;
    } else if (const auto* undo = std::get_if<UndoRow>(&row.what)) {
      bone_back = std::ranges::any_of(undo->places, [&](RoomSeq place) { return of_bone[place]; });
    } else if (const auto* redo = std::get_if<RedoRow>(&row.what)) {
      bone_back = std::ranges::any_of(redo->places, [&](RoomSeq place) { return of_bone[place]; });
    } else if (std::holds_alternative<SplitRow>(row.what) || std::holds_alternative<RemoveBodyRow>(row.what)) {
      of_bone[row.place] = true;
    }
    if (bone_back)
      for (auto& [author, epoch] : lease) epoch = row.place.value + 1;
    const auto told = told_.find(row.place);
    check(told == told_.end() || told->second == kept, Invariant::acknowledged,
          "row " + number(row.place) + " is another event than was told");
  }
  for (const auto& [author, author_seq] : decided_)
    check(newest[author] >= author_seq, Invariant::acknowledged,
          whose(author, author_seq) + " was said to be decided, and is not kept");
}

std::map<AuthorId, Restrictions> Ledger::held(std::span<const RoomRow> rows) {
  std::map<AuthorId, Restrictions> held;
  for (const RoomRow& row : rows)
    if (const auto* decided = std::get_if<SuperviseRow>(&row.what)) held[decided->subject] = decided->supervision;
  return held;
}

std::optional<std::vector<Cut>> Ledger::standing(std::span<const RoomRow> rows) {
  std::map<RoomSeq, const Cut*> cuts;
  std::set<RoomSeq> fallen;
  for (const RoomRow& row : rows) {
    if (std::holds_alternative<SplitRow>(row.what)) return std::nullopt;
    if (const auto* cut = std::get_if<CutRow>(&row.what)) cuts[row.place] = &cut->cut;
    if (const auto* undo = std::get_if<UndoRow>(&row.what)) fallen.insert(undo->places.begin(), undo->places.end());
    if (const auto* redo = std::get_if<RedoRow>(&row.what))
      for (const RoomSeq place : redo->places) fallen.erase(place);
  }
  std::vector<Cut> all;
  for (const auto& [place, cut] : cuts)
    if (!fallen.contains(place)) all.push_back(*cut);
  return all;
}

}  // namespace osteon::test
