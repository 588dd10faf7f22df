// What a RoomKeeper does beside the commits of a room in use.
#include <utility>

#include "server/net/room_keeper.hpp"

namespace osteon {
namespace {

constexpr std::size_t kSliceRows = 256;  // read and hashed in a millisecond or two, which a commit may wait

}  // namespace

Result<void> RoomKeeper::each_row(JournalHead& at, RoomSeq last, const std::function<bool(const JournalRow&)>& take) {
  while (at.place < last) {
    Result<JournalSlice> slice =
        with_journal([&](Journal& journal) -> Result<JournalSlice> { return journal.read_slice(at, last, kSliceRows); });
    if (!slice) return tl::unexpected(slice.error());
    at = slice->head;
    for (const JournalRow& row : slice->rows)
      if (!take(row)) return {};
    if (slice->stopped) return tl::unexpected(*slice->stopped);
    if (slice->rows.empty()) return failure(ErrorCode::invalid_input, file_.string() + " has no row " + std::to_string(at.place.value + 1));
  }
  return {};
}

Result<void> RoomKeeper::read(RoomSeq from, RoomSeq to, const std::function<bool(const RoomRow&)>& take) {
  Result<JournalHead> at = with_journal([&](Journal& journal) -> Result<JournalHead> {
    to = std::min(to, journal.head().place);
    if (from > to) return JournalHead{to, {}};
    return journal.head_at(RoomSeq{from ? from.value - 1 : 0});
  });
  if (!at) return tl::unexpected(at.error());
  Result<void> outcome;
  const Result<void> read = each_row(*at, to, [&](const JournalRow& one) {
    const Result<RoomRow> row = row_from_bytes(one.place, std::chrono::nanoseconds(one.at_ns), one.bytes);
    if (!row) outcome = tl::unexpected(row.error());
    return row && take(*row);
  });
  return outcome ? read : outcome;
}

Result<void> RoomKeeper::run(JournalCopy& copy, const UpkeepCalls& calls) {
  for (Result<bool> done = false; !*done;) {
    if (calls.stop && calls.stop()) return given_up("the copy of " + file_.string());
    const Result<void> taken = with_journal([&](Journal&) { return copy.take(kSliceRows); });
    if (!taken) return taken;
    done = copy.put();
    if (!done) return tl::unexpected(done.error());
    if (calls.progress) calls.progress(copy.fraction());
  }
  return {};
}

Result<JournalHead> RoomKeeper::backup(const std::filesystem::path& to, const UpkeepCalls& calls) {
  Result<JournalCopy> copy = with_journal([&](Journal& journal) { return JournalCopy::begin(journal, to); });
  if (!copy) return tl::unexpected(copy.error());
  if (const Result<void> done = run(*copy, calls); !done) return tl::unexpected(done.error());
  return copy->head();
}

Result<JournalHead> RoomKeeper::branch(const std::filesystem::path& to, RoomSeq place, const std::string& name,
                                       const UpkeepCalls& calls) {
  Result<JournalCopy> copy = with_journal([&](Journal& journal) { return begin_branch(journal, to, place, name); });
  if (!copy) return tl::unexpected(copy.error());
  if (const Result<void> done = run(*copy, calls); !done) return tl::unexpected(done.error());
  return copy->head();
}

Result<RoomReport> RoomKeeper::verify(const Case& bone, const std::optional<BoneAt>& live, const UpkeepCalls& calls) {
  Result<Room> room = begin_room(bone, genesis_, {});
  if (!room) return tl::unexpected(room.error());
  RoomReport report;
  RoomSeq last;
  const auto begun = with_journal([&](Journal& journal) -> Result<JournalHead> {
    last = journal.head().place;
    report.faults = verify_beside(journal);
    return journal.head_at(RoomSeq{});
  });
  if (!begun) return tl::unexpected(begun.error());
  if (live && live->place > last)
    return failure(ErrorCode::unavailable, "event " + std::to_string(live->place.value) + " of " + genesis_.room + " is not kept yet");
  report.head = *begun;
  bool stopped = false;
  Result<void> replayed;
  const Result<void> read = each_row(report.head, last, [&](const JournalRow& one) {
    stopped = calls.stop && calls.stop();
    if (stopped) return false;
    if (calls.progress && one.place.value % 64 == 0)
      calls.progress(static_cast<double>(one.place.value) / static_cast<double>(last.value));
    if (!live || one.place > live->place || !replayed) return true;
    const Result<RoomRow> row = row_from_bytes(one.place, std::chrono::nanoseconds(one.at_ns), one.bytes);
    replayed = row ? room->replay(*row) : Result<void>(tl::unexpected(row.error()));
    (void)room->take_changes();
    return true;
  });
  if (stopped) return given_up("the check of " + genesis_.room);
  if (!read) report.faults.push_back(read.error().message);
  return report;
}

}  // namespace osteon
