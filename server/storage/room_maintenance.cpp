// The work of RoomStore beside the commits of a room in use.
#include <algorithm>
#include <optional>
#include <utility>

#include "common/field/field_hash.hpp"
#include "server/journal/journal_file.hpp"
#include "server/storage/people_erasing.hpp"
#include "server/storage/room_store.hpp"

namespace osteon {
namespace {

constexpr std::size_t kSliceEntries = 256;  // read and hashed in a millisecond or two, which a commit may wait

}  // namespace

Result<void> RoomStore::each_entry(JournalHead& at, RoomSeq last,
                                   const std::function<bool(const JournalEntry&)>& take) {
  while (at.seq < last) {
    Result<JournalSlice> slice = with_journal(
        [&](Journal& journal) -> Result<JournalSlice> { return journal.read_slice(at, last, kSliceEntries); });
    if (!slice) return tl::unexpected(slice.error());
    at = slice->head;
    for (const JournalEntry& entry : slice->entries)
      if (!take(entry)) return {};
    if (slice->stopped) return tl::unexpected(*slice->stopped);
    if (slice->entries.empty())
      return failure(ErrorCode::invalid_input, file_.string() + " has no entry " + std::to_string(at.seq.value + 1));
  }
  return {};
}

Result<void> RoomStore::read(RoomSeq from, RoomSeq to, const std::function<bool(const LogEntry&)>& take) {
  Result<JournalHead> at = with_journal([&](Journal& journal) -> Result<JournalHead> {
    to = std::min(to, journal.head().seq);
    if (from > to) return JournalHead{to, {}};
    return journal.head_at(RoomSeq{from ? from.value - 1 : 0});
  });
  if (!at) return tl::unexpected(at.error());
  Result<void> outcome;
  const Result<void> read = each_entry(*at, to, [&](const JournalEntry& one) {
    const Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
    if (!entry) outcome = tl::unexpected(entry.error());
    return entry && take(*entry);
  });
  return outcome ? read : outcome;
}

Result<void> RoomStore::run(JournalCopy& copy, const MaintenanceCalls& calls) {
  for (Result<bool> done = false; !*done;) {
    if (closing_) return is_closed();
    if (calls.stop && calls.stop()) return given_up("the copy of " + file_.string());
    const Result<void> taken = with_journal([&](Journal&) { return copy.take(kSliceEntries); });
    if (!taken) return taken;
    done = copy.put();
    if (!done) return tl::unexpected(done.error());
    if (calls.progress) calls.progress(copy.fraction());
  }
  return {};
}

Result<JournalHead> RoomStore::backup(const std::filesystem::path& to, const MaintenanceCalls& calls) {
  Result<JournalCopy> copy = with_journal([&](Journal& journal) { return JournalCopy::begin(journal, to); });
  if (!copy) return tl::unexpected(copy.error());
  if (const Result<void> done = run(*copy, calls); !done) return tl::unexpected(done.error());
  return copy->head();
}

Result<JournalHead> RoomStore::branch(const std::filesystem::path& to, RoomSeq seq, const std::string& name,
                                      const MaintenanceCalls& calls) {
  Result<JournalCopy> copy = with_journal([&](Journal& journal) { return begin_branch(journal, to, seq, name); });
  if (!copy) return tl::unexpected(copy.error());
  if (const Result<void> done = run(*copy, calls); !done) return tl::unexpected(done.error());
  return copy->head();
}

Result<RoomReport> RoomStore::verify(const Case& bone, const std::optional<BoneAt>& live,
                                     const MaintenanceCalls& calls) {
  std::optional<Room> room;
  if (live) {
    Result<Room> begun = begin_room(bone, genesis_, {});
    if (!begun) return tl::unexpected(begun.error());
    room.emplace(std::move(*begun));
  }
  RoomReport report;
  RoomSeq last;
  const auto checkpoints = with_journal([&](Journal& journal) -> Result<std::vector<Checkpoint>> {
    last = journal.head().seq;
    report.head = first_head(journal.genesis());
    report.faults = verify_beside(journal);
    // If the list of checkpoints cannot be read, the journal has just said so.
    return journal.checkpoints().value_or(std::vector<Checkpoint>{});
  });
  if (!checkpoints) return tl::unexpected(checkpoints.error());
  const RoomSeq replayed_to = live ? live->seq : RoomSeq{};
  if (replayed_to > last)
    return failure(ErrorCode::unavailable, "event " + std::to_string(replayed_to.value) + " of the room " +
                                               genesis_.room + " is not durable yet; try again");

  // Entries, and what they make.
  bool stopped = false;
  Result<void> outcome;
  const Result<void> read = each_entry(report.head, last, [&](const JournalEntry& one) {
    stopped = calls.stop && calls.stop();
    if (stopped) return false;
    if (calls.progress && one.seq.value % 64 == 0)
      calls.progress(static_cast<double>(one.seq.value) / static_cast<double>(last.value));
    if (!outcome) return true;  // the following entries are still checked against the chain
    const Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
    if (!entry) outcome = tl::unexpected(entry.error());
    if (!entry || !room || one.seq > replayed_to) return true;
    outcome = room->replay(*entry);
    (void)room->take_changes();
    for (const Checkpoint& point : *checkpoints)
      if (point.at.seq == one.seq && to_hex(field_hash(room->all_leaves(), pitch_mm_)) != point.meta)
        report.faults.push_back("the checkpoint at event " + std::to_string(one.seq.value) + " of " + file_.string() +
                                " is not what its entries make; remove it");
    return true;
  });
  if (stopped) return given_up("the check of the room " + genesis_.room);
  if (!read && read.error().code == ErrorCode::unavailable) return tl::unexpected(read.error());
  if (!read) {
    report.first_bad = RoomSeq{report.head.seq.value + 1};
    report.faults.push_back(read.error().message);
  }
  if (!outcome) report.faults.push_back(file_.string() + ": " + outcome.error().message);
  if (room && outcome && room->room_seq() == live->seq) {
    report.replayed = {live->seq, room->field_hash()};
    if (report.replayed.field_hash != live->field_hash)
      report.faults.push_back("the entries of the room " + genesis_.room + " up to " + std::to_string(live->seq.value) +
                              " make another bone than the one that is being cut; close the room and open it again");
  }

  for (const Checkpoint& one : *checkpoints) {
    if (calls.stop && calls.stop()) return given_up("the check of the room " + genesis_.room);
    if (const Result<void> good = check_bytes(one, report); !good) return tl::unexpected(good.error());
  }
  return report;
}

// Without the journal's lock, since a checkpoint's file never changes.
Result<void> RoomStore::check_bytes(const Checkpoint& one, RoomReport& report) {
  std::string bytes;
  const std::filesystem::path file = checkpoint_file(file_, one.at);
  const auto read = read_in_pieces(disk_, file, [&](std::string_view piece) {
    bytes += piece;
    return Result<void>{};
  });
  Result<void> good;
  if (!read)
    good = tl::unexpected(read.error());
  else if (read->size != one.size || read->digest != one.digest)
    good = failure(ErrorCode::invalid_input,
                   file.string() + " is not what was written; the checkpoint before it has to serve");
  else if (const auto fields = fields_of(one, bytes); !fields)
    good = tl::unexpected(fields.error());
  if (good) {
    ++report.checkpoints;
    return {};
  }
  const auto known = with_journal([](Journal& journal) { return journal.checkpoints(); });
  if (!known && known.error().code == ErrorCode::unavailable) return tl::unexpected(known.error());
  const bool replaced =
      known && std::ranges::none_of(*known, [&](const Checkpoint& kept) { return kept.at == one.at; });
  if (!replaced) report.faults.push_back(good.error().message);
  return {};
}

Result<std::vector<Person>> RoomStore::people() {
  return with_journal([](Journal& journal) { return journal.people(); });
}

Result<bool> RoomStore::erase_person(std::uint32_t person) {
  return with_journal([&](Journal& journal) {
           return erase_people(
               journal, [](const Person&) { return false; }, person);
         })
      .and_then([&](const ErasedPeople& erased) {
        return erase_owner(file_, erased).map([&] { return erased.people + erased.entries > 0; });
      });
}

Result<std::size_t> RoomStore::erase_old_people() {
  return with_journal([&](Journal& journal) -> Result<std::size_t> {
    if (retention_days_ <= 0) return 0;
    const std::int32_t day = today_() - retention_days_;
    return erase_people(journal, [&](const Person& person) { return person.joined_day < day; })
        .and_then(
            [&](const ErasedPeople& erased) { return erase_owner(file_, erased).map([&] { return erased.people; }); });
  });
}

Result<void> RoomStore::export_person(std::uint32_t person, const std::function<bool(const std::string&)>& take) {
  RoomSeq last;
  JournalHead at;
  const auto people = with_journal([&](Journal& journal) {
    last = journal.head().seq;
    at = first_head(journal.genesis());
    return journal.people();
  });
  if (!people) return tl::unexpected(people.error());
  PersonExport lines(person, *people);
  if (const auto& who = lines.who(); who && !take(*who)) return {};
  Result<void> outcome;
  bool any = lines.who().has_value();
  const Result<void> read = each_entry(at, last, [&](const JournalEntry& entry) {
    const Result<std::optional<std::string>> line = lines.of(entry);
    if (!line) outcome = tl::unexpected(line.error());
    any = any || (line && *line);
    return line && (!*line || take(**line));
  });
  if (!outcome) return outcome;
  if (read && !any) return lines.nobody();
  return read;
}

Result<void> RoomStore::tidy_if_idle() {
  return with_journal([&](Journal& journal) -> Result<void> {
    const RoomSeq now = journal.head().seq;
    const bool idle = idle_at_ == now;
    idle_at_ = now;
    if (!idle || journal.closed_because() != nullptr) return {};
    return journal.tidy();
  });
}

Result<bool> RoomStore::has_head(const JournalHead& head) {
  return with_journal([&](Journal& journal) -> Result<bool> {
    if (head.seq > journal.head().seq) return false;
    return journal.head_at(head.seq).map([&](const JournalHead& here) { return here == head; });
  });
}

}  // namespace osteon
