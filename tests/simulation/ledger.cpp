#include "tests/simulation/ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

namespace osteon::test {
namespace {

std::string number(RoomSeq seq) { return std::to_string(seq.value); }

std::string whose(AuthorId author, std::uint64_t author_seq) {
  return "cut " + std::to_string(author_seq) + " of author " + std::to_string(author.value);
}

bool lies_in(const ZoneLimit& zone, const std::array<std::int32_t, 3>& tip) {
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) square += std::pow(double{1} * tip[axis] - zone.centre[axis], 2);
  return square <= std::pow(double{1} * zone.radius, 2);
}

std::optional<EventKind> kind_of(const LogEntry& entry) {
  struct Kind {
    EventKind operator()(const JoinEntry&) const { return EventKind::join; }
    EventKind operator()(const CutEntry&) const { return EventKind::cut; }
    EventKind operator()(const RejectionEntry&) const { return EventKind::cut; }
    EventKind operator()(const SplitEntry&) const { return EventKind::split; }
    EventKind operator()(const UndoEntry&) const { return EventKind::undo; }
    EventKind operator()(const RedoEntry&) const { return EventKind::redo; }
    EventKind operator()(const RemoveBodyEntry&) const { return EventKind::remove_body; }
    EventKind operator()(const ItemEntry&) const { return EventKind::scene; }
    EventKind operator()(const ToolEntry&) const { return EventKind::tool; }
    EventKind operator()(const MarkEntry&) const { return EventKind::mark; }
    EventKind operator()(const SuperviseEntry&) const { return EventKind::supervise; }
    EventKind operator()(const AnnotationEntry&) const { return EventKind::annotation; }
    EventKind operator()(const WordsEntry&) const { return EventKind::words; }
  };
  return std::visit(Kind{}, entry.what);
}

}  // namespace

// The authors that have joined with a hand, their restrictions, and the cuts.
struct Ledger::Hands {
  std::map<AuthorId, std::uint32_t> persons;  // of those that cut, in the order of their joins
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
    case Invariant::supervised:
      return "supervised";
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

void Ledger::told(RoomSeq seq, const Told& what) {
  told_up_to(seq);
  const auto [at, first] = told_.emplace(seq, what);
  check(first || at->second == what, Invariant::acknowledged,
        "sequence number " + number(seq) + " was sent twice, as different events");
}

void Ledger::told_committed(RoomSeq seq, const Cut& cut) {
  told(seq, {EventKind::cut, false, cut.author, cut.author_seq, cut_digest(cut)});
}
void Ledger::told_rejected(RoomSeq seq, AuthorId author, std::uint64_t author_seq) {
  told(seq, {EventKind::cut, true, author, author_seq, {}});
}
void Ledger::told_event(RoomSeq seq, EventKind kind) { told(seq, {kind, false, {}, 0, {}}); }
void Ledger::told_up_to(RoomSeq seq) {
  check(seq <= kept_, Invariant::acknowledged,
        "sequence number " + number(seq) + " was sent while the entries were durable up to " + number(kept_));
  furthest_ = std::max(furthest_, seq);
}
void Ledger::told_decided(AuthorId author, std::uint64_t author_seq) {
  std::uint64_t& newest = decided_[author];
  newest = std::max(newest, author_seq);
}

void Ledger::acknowledged_seq(RoomSeq seq, AuthorId author, std::uint64_t author_seq) {
  const std::vector<Cut>& own = made_[author];
  if (author_seq == 0 || author_seq > own.size())
    return fault(Invariant::acknowledged, whose(author, author_seq) + " has a sequence number, and was never made");
  if (seq)
    told_committed(seq, own[author_seq - 1]);
  else
    rejected_.emplace(author, author_seq);
}

void Ledger::check_author(const LogEntry& entry, AuthorId author, std::uint64_t author_seq, const Digest& bytes,
                          std::map<AuthorId, std::uint64_t>& newest) {
  const std::uint64_t next = ++newest[author];
  check(author_seq == next, Invariant::author_order,
        "entry " + number(entry.seq) + " is " + whose(author, author_seq) + ", where " + std::to_string(next) +
            " comes next");
  const std::vector<Cut>& own = made_[author];
  if (author_seq == 0 || author_seq > own.size())
    return fault(Invariant::author_order,
                 "entry " + number(entry.seq) + " is " + whose(author, author_seq) + ", who never made it");
  check(cut_digest(own[author_seq - 1]) == bytes, Invariant::author_order,
        "entry " + number(entry.seq) + " is " + whose(author, author_seq) + ", with other bytes than were made");
}

void Ledger::check_held(const LogEntry& entry, const Hands& hands) {
  const bool changes = std::holds_alternative<UndoEntry>(entry.what) || std::holds_alternative<RedoEntry>(entry.what) ||
                       std::holds_alternative<ItemEntry>(entry.what) ||
                       std::holds_alternative<RemoveBodyEntry>(entry.what);
  const Restrictions now = hands.of(entry.author);
  check(!changes || (!now.stopped && now.taken_by == AuthorId{}), Invariant::supervised,
        "entry " + number(entry.seq) + " is what author " + std::to_string(entry.author.value) + " did while held");
  const auto* redo = std::get_if<RedoEntry>(&entry.what);
  if (redo == nullptr) return;
  for (const RoomSeq seq : redo->seqs)
    if (const auto cut = hands.cuts.find(seq); cut != hands.cuts.end())
      check_cut(entry, hands, entry.author, *cut->second);
}

void Ledger::check_cut(const LogEntry& entry, const Hands& hands, AuthorId by, const Cut& cut) {
  const Restrictions now = hands.of(by);
  const auto forbidden = [&](const std::string& why) {
    fault(Invariant::supervised, "entry " + number(entry.seq) + " has " + whose(cut.author, cut.author_seq) +
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

// A person who restarts their program has the same restrictions, from the next entry on.
void Ledger::check_carried(std::span<const LogEntry> entries, std::size_t join, Hands& hands) {
  const auto& joined = std::get<JoinEntry>(entries[join].what);
  Restrictions before;
  for (const auto& [author, person] : hands.persons)
    if (person != 0 && person == joined.person) before = hands.of(author);
  hands.persons[joined.author] = joined.person;
  if (before == Restrictions{}) return;
  const auto* next = join + 1 < entries.size() ? std::get_if<SuperviseEntry>(&entries[join + 1].what) : nullptr;
  check(next != nullptr && next->subject == joined.author && next->supervision == before, Invariant::supervised,
        "entry " + number(entries[join].seq) + " lets a person's new hand go, author " +
            std::to_string(joined.author.value));
}

void Ledger::check_entries(std::span<const LogEntry> entries) {
  if (furthest_.value > entries.size())
    fault(Invariant::acknowledged, "the room was said to stand at " + number(furthest_) + ", and " +
                                       std::to_string(entries.size()) + " entries are kept");
  std::map<AuthorId, std::uint64_t> newest, lease;  // of the leases that are not 1
  std::map<RoomSeq, bool> of_bone;                  // events that can be undone: whether bone comes back with them
  Hands hands;
  const auto lease_of = [&](AuthorId author) {
    const auto found = lease.find(author);
    return found == lease.end() ? std::uint64_t{1} : found->second;
  };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const LogEntry& entry = entries[i];
    check(entry.seq.value == i + 1, Invariant::replay,
          "entry " + std::to_string(i + 1) + " has the sequence number " + number(entry.seq));
    Told kept{*kind_of(entry), false, {}, 0, {}};
    bool bone_back = false;
    check_held(entry, hands);
    if (const auto* cut = std::get_if<CutEntry>(&entry.what)) {
      const Digest bytes = cut_digest(cut->cut);
      kept = {EventKind::cut, false, cut->cut.author, cut->cut.author_seq, bytes};
      check_author(entry, cut->cut.author, cut->cut.author_seq, bytes, newest);
      check(!rejected_.contains({cut->cut.author, cut->cut.author_seq}), Invariant::acknowledged,
            "entry " + number(entry.seq) + " is a cut that was said to be rejected");
      check(cut->cut.lease_epoch == lease_of(cut->cut.author), Invariant::lease,
            "entry " + number(entry.seq) + ", " + whose(cut->cut.author, cut->cut.author_seq) + ", is of lease " +
                std::to_string(cut->cut.lease_epoch) + " where " + std::to_string(lease_of(cut->cut.author)) +
                " holds");
      of_bone[entry.seq] = true;
      hands.cuts[entry.seq] = &cut->cut;
      check_cut(entry, hands, cut->cut.author, cut->cut);
    } else if (const auto* rejection = std::get_if<RejectionEntry>(&entry.what)) {
      // All these hands are honest.
      check(rejection->reason != Rejection::time, Invariant::served,
            "entry " + number(entry.seq) + " says that " + whose(rejection->author, rejection->author_seq) +
                " took longer than time has passed");
      kept = {EventKind::cut, true, rejection->author, rejection->author_seq, {}};
      check_author(entry, rejection->author, rejection->author_seq, rejection->bytes, newest);
      if (rejection->reason == Rejection::lease) {
        const std::vector<Cut>& own = made_[rejection->author];
        check(rejection->author_seq <= own.size() &&
                  own[rejection->author_seq - 1].lease_epoch != lease_of(rejection->author),
              Invariant::lease, "entry " + number(entry.seq) + " rejects a cut of the lease that holds");
      } else {
        lease[rejection->author] = entry.seq.value + 1;
      }
    } else if (const auto* join = std::get_if<JoinEntry>(&entry.what)) {
      lease[join->author] = 1;
      if (join->kind == MemberKind::surgeon) check_carried(entries, i, hands);
    } else if (const auto* decided = std::get_if<SuperviseEntry>(&entry.what)) {
      Restrictions& before = hands.held[decided->subject];
      const Restrictions& now = decided->supervision;
      if (before.stopped != now.stopped || before.taken_by != now.taken_by)
        lease[decided->subject] = entry.seq.value + 1;
      before = now;
    } else if (const auto* undo = std::get_if<UndoEntry>(&entry.what)) {
      bone_back = std::ranges::any_of(undo->seqs, [&](RoomSeq seq) { return of_bone[seq]; });
    } else if (const auto* redo = std::get_if<RedoEntry>(&entry.what)) {
      bone_back = std::ranges::any_of(redo->seqs, [&](RoomSeq seq) { return of_bone[seq]; });
    } else if (std::holds_alternative<SplitEntry>(entry.what) || std::holds_alternative<RemoveBodyEntry>(entry.what)) {
      of_bone[entry.seq] = true;
    }
    if (bone_back)
      for (auto& [author, epoch] : lease) epoch = entry.seq.value + 1;
    const auto told = told_.find(entry.seq);
    check(told == told_.end() || told->second == kept, Invariant::acknowledged,
          "entry " + number(entry.seq) + " is another event than was sent");
  }
  for (const auto& [author, author_seq] : decided_)
    check(newest[author] >= author_seq, Invariant::acknowledged,
          whose(author, author_seq) + " was said to be decided, and is not kept");
}

std::map<AuthorId, Restrictions> Ledger::held(std::span<const LogEntry> entries) {
  std::map<AuthorId, Restrictions> held;
  for (const LogEntry& entry : entries)
    if (const auto* decided = std::get_if<SuperviseEntry>(&entry.what)) held[decided->subject] = decided->supervision;
  return held;
}

std::optional<std::vector<Cut>> Ledger::standing(std::span<const LogEntry> entries) {
  std::map<RoomSeq, const Cut*> cuts;
  std::set<RoomSeq> fallen;
  for (const LogEntry& entry : entries) {
    if (std::holds_alternative<SplitEntry>(entry.what)) return std::nullopt;
    if (const auto* cut = std::get_if<CutEntry>(&entry.what)) cuts[entry.seq] = &cut->cut;
    if (const auto* undo = std::get_if<UndoEntry>(&entry.what)) fallen.insert(undo->seqs.begin(), undo->seqs.end());
    if (const auto* redo = std::get_if<RedoEntry>(&entry.what))
      for (const RoomSeq seq : redo->seqs) fallen.erase(seq);
  }
  std::vector<Cut> all;
  for (const auto& [seq, cut] : cuts)
    if (!fallen.contains(seq)) all.push_back(*cut);
  return all;
}

}  // namespace osteon::test
