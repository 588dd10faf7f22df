#include "server/audit/audit_log.hpp"

#include <algorithm>
#include <charconv>
#include <set>
#include <thread>
#include <utility>

#include "common/runtime/log.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLongestEnd = std::uint64_t{1} << 16;  // bytes; a record has less
constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;
constexpr std::chrono::milliseconds kLockPatience{5000}, kLockEvery{5};
constexpr std::string_view kBegins = "begins at ", kAfter = " after ";

// The lock for changing the log or the people file beside it. Makes the lock's file if it is missing.
Result<std::unique_ptr<DiskLock>> lock(Disk& disk, const fs::path& log) {
  const std::string name = log.filename().string();
  const fs::path file = folder_of(log) / (name.substr(0, name.find('.')) + ".lock");
  if (const auto made = disk.open(file); !made) return tl::unexpected(made.error());
  for (std::chrono::milliseconds waited{0};; waited += kLockEvery) {
    auto held = disk.lock(file, LockKind::exclusive);
    if (held || held.error().code != ErrorCode::exists) return held;
    if (waited >= kLockPatience)
      return failure(ErrorCode::unavailable, "another process holds " + file.string() + "; try again");
    std::this_thread::sleep_for(kLockEvery);
  }
}

}  // namespace

std::string detail_of(const AuditStart& start) {
  return std::string(kBegins) + std::to_string(start.sequence) + std::string(kAfter) + to_hex(start.previous);
}

std::optional<AuditStart> start_of(const AuditRecord& record) {
  std::string_view text = record.detail;
  if (record.action != kRetention || !text.starts_with(kBegins)) return {};
  text.remove_prefix(kBegins.size());
  AuditStart start;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), start.sequence);
  if (wrong != std::errc{}) return {};
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (!text.starts_with(kAfter)) return {};
  const Result<Digest> previous = digest_from_hex(text.substr(kAfter.size()));
  if (!previous) return {};
  start.previous = *previous;
  return start;
}

AuditLog::AuditLog(Disk& disk, fs::path file, std::shared_ptr<const SigningKeys> keys, Unfit unfit)
    : disk_(&disk),
      file_(std::move(file)),
      keys_(std::move(keys)),
      unfit_(unfit),
      people_(disk, people_file_of(file_)) {}

Result<AuditLog> AuditLog::open(Disk& disk, fs::path file, std::shared_ptr<const SigningKeys> keys, Unfit unfit) {
  AuditLog log(disk, std::move(file), std::move(keys), unfit);
  const auto held = lock(disk, log.file_);
  if (!held) return tl::unexpected(held.error());
  if (const Result<void> read = log.refresh(); !read) return tl::unexpected(read.error());
  log.opened_ = true;
  return log;
}

Result<void> AuditLog::refresh() {
  const auto now = disk_->identity(file_);
  if (!now) return tl::unexpected(now.error());
  if (*now && seen_ && seen_->same_file(**now) && seen_->size == (*now)->size) return {};
  // After a failed write: the next write overwrites what it left.
  if (*now && seen_ && seen_->same_file(**now) && (*now)->size > seen_->size && (*now)->size <= seen_->size + unsure_) {
    unsure_ = (*now)->size - seen_->size;
    return {};
  }
  unsure_ = 0;
  if (*now && (*now)->size > 0) return read_end((*now)->size);
  seen_ = *now;
  named_ = false;
  if (sequence_ > 0) warn_of_loss();
  return {};
}

// The next record continues what this process has written, so "audit verify" finds the gap.
void AuditLog::warn_of_loss() const {
  log::error("records of the audit log were removed while this process uses it",
             {{"file", file_.string()}, {"last_sequence", sequence_}});
}

Result<void> AuditLog::read_end(std::uint64_t size) {
  const std::uint64_t from = size - std::min(size, kLongestEnd);
  const Result<std::string> read = disk_->read(file_, from, static_cast<std::size_t>(size - from));
  if (!read) return tl::unexpected(read.error());
  const std::size_t whole = read->rfind('\n');
  if (whole == std::string::npos && from > 0) return replace("its last 64 KiB contain no line end");
  // An incomplete line was never acknowledged: its writer was killed, or the disk was full.
  const std::uint64_t end = whole == std::string::npos ? 0 : from + whole + 1;
  if (end < size) {
    log::warn("the audit log ends in the middle of a line, which is removed",
              {{"file", file_.string()}, {"bytes", size - end}});
    if (Result<void> kept = keep_only(0, end); !kept) return kept;
  } else if (Result<void> noted = note_identity(); !noted) {
    return noted;
  }
  if (end == 0) {
    if (sequence_ > 0) warn_of_loss();
    return {};
  }
  const std::string_view lines(read->data(), whole);
  const std::string_view line = lines.substr(lines.rfind('\n') + 1);
  const Result<AuditRecord> record = decode_record(line);
  if (!record) return replace("its last line is damaged: " + record.error().message);
  // While this process runs, a command may have changed to a key that is unknown here.
  if (!opened_ && !keys_->trusts(record->key))
    return replace("its last record is signed by another key, " + to_hex(record->key));
  if (record->sequence < sequence_) {
    warn_of_loss();
    return {};
  }
  sequence_ = record->sequence;
  last_ = hash_of_line(line);
  return {};
}

Result<void> AuditLog::replace(const std::string& why) {
  if (unfit_ == Unfit::refuse)
    return failure(ErrorCode::invalid_input, "nothing can be added to the audit log " + file_.string() + ": " + why +
                                                 "; \"osteon-server audit verify\" gives details");
  fs::path aside = file_;
  std::string time = rfc3339(std::chrono::system_clock::now());
  std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
  aside += "." + time;
  if (Result<void> renamed = disk_->rename(file_, aside); !renamed) return renamed;
  if (Result<void> synced = disk_->sync_folder(folder_of(file_)); !synced) return synced;
  log::error("the audit log was set aside, and a new one begins",
             {{"file", file_.string()}, {"reason", why}, {"set_aside", aside.string()}});
  aside_ = AuditEvent{.action = "set-aside", .object = aside.filename().string(), .result = kFailed, .detail = why};
  seen_.reset();
  named_ = false;
  return {};
}

Result<void> AuditLog::note_identity() {
  const auto now = disk_->identity(file_);
  if (!now) return tl::unexpected(now.error());
  seen_ = *now;
  return {};
}

Result<void> AuditLog::keep_only(std::uint64_t from, std::uint64_t to) {
  Result<DurableFile> rewritten = DurableFile::begin(*disk_, file_);
  if (!rewritten) return tl::unexpected(rewritten.error());
  for (std::uint64_t at = from; at < to;) {
    const Result<std::string> piece = disk_->read(file_, at, static_cast<std::size_t>(std::min(to - at, kPiece)));
    if (!piece) return tl::unexpected(piece.error());
    if (piece->empty()) return failure(ErrorCode::internal, file_.string() + " became shorter while it was copied");
    if (Result<void> put = rewritten->write(*piece); !put) return put;
    at += piece->size();
  }
  if (const auto done = rewritten->finish(); !done) return tl::unexpected(done.error());
  return note_identity();
}

Result<std::vector<AuditLog::Written>> AuditLog::append(std::span<const AuditEvent> events) {
  const auto held = lock(*disk_, file_);
  if (!held) return tl::unexpected(held.error());
  if (const Result<void> read = refresh(); !read) return tl::unexpected(read.error());
  if (!aside_) return write(events);
  std::vector<AuditEvent> with_that{*aside_};
  with_that.insert(with_that.end(), events.begin(), events.end());
  auto written = write(with_that);
  if (!written) return written;
  aside_.reset();
  written->erase(written->begin());
  return written;
}

Result<std::vector<AuditLog::Written>> AuditLog::write(std::span<const AuditEvent> events) {
  if (const Result<void> read = people_.refresh(); !read) return tl::unexpected(read.error());
  std::vector<Written> written;
  std::string lines;
  std::uint64_t sequence = sequence_;
  Digest previous = last_;
  for (const AuditEvent& event : events) {
    AuditRecord record{.sequence = ++sequence,
                       .time = rfc3339(event.at),
                       .identity = people_.pseudonym(clean(event.who)),
                       .action = clean_text(event.action),
                       .object = clean_text(event.object),
                       .result = clean_text(event.result),
                       .detail = clean_text(event.detail),
                       .previous = previous,
                       .key = {}};
    const std::string line = encode(record, keys_->key());
    previous = hash_of_line(line);
    lines += line + "\n";
    written.push_back({std::move(record), previous});
  }
  // The identities first, so that every pseudonym in a record has its stored identity.
  if (const Result<void> saved = people_.save(); !saved) return tl::unexpected(saved.error());
  if (const Result<void> put = put_at_end(lines); !put) return tl::unexpected(put.error());
  sequence_ = sequence;
  last_ = previous;
  return written;
}

Result<void> AuditLog::put_at_end(const std::string& lines) {
  const std::uint64_t end = seen_ ? seen_->size : 0;
  if (unsure_ > lines.size())
    if (Result<void> kept = keep_only(0, end); !kept) return kept;
  auto out = disk_->open(file_);
  if (!out) return tl::unexpected(out.error());
  Result<void> done = (*out)->write_durably(end, lines);
  if (done && !named_) done = disk_->sync_folder(folder_of(file_));
  const auto now = disk_->identity(file_);
  if (done && !now) done = tl::unexpected(now.error());
  if (now) seen_ = *now;
  if (!done && seen_) seen_->size = end;
  unsure_ = done ? 0 : lines.size();
  named_ = named_ || done.has_value();
  return done;
}

Result<std::size_t> AuditLog::remove_before(std::chrono::system_clock::time_point time) {
  const auto held = lock(*disk_, file_);
  if (!held) return tl::unexpected(held.error());
  if (const Result<void> read = refresh(); !read) return tl::unexpected(read.error());
  if (!seen_) return std::size_t{0};
  // Finds the first record that stays. If none stays, it is the record that reports the removal.
  const std::string limit = rfc3339(time);
  AuditStart start{.sequence = sequence_ + 1, .previous = last_};
  std::uint64_t from = seen_->size, line_begins = 0;
  std::size_t removed = 0;
  Result<void> outcome;
  const auto look = [&](std::string_view line, std::uint64_t next) {
    const Result<AuditRecord> record = decode_record(line);
    if (!record)
      outcome = failure(ErrorCode::invalid_input, file_.string() + " is damaged, so nothing of it is removed");
    if (!record || record->time >= limit) {
      if (record) start = {record->sequence, record->previous}, from = line_begins;
      return false;
    }
    ++removed;
    line_begins = next;
    return true;
  };
  if (const auto rest = for_each_line(*disk_, file_, look); !rest) return tl::unexpected(rest.error());
  if (!outcome) return tl::unexpected(outcome.error());
  if (removed == 0) return removed;
  // The record first: a file that begins earlier than the record says is valid.
  const AuditEvent said{
      .action = kRetention, .object = std::to_string(removed) + " records", .result = kOk, .detail = detail_of(start)};
  if (const auto written = write(std::span(&said, 1)); !written) return tl::unexpected(written.error());
  if (Result<void> kept = keep_only(from, seen_->size); !kept) return tl::unexpected(kept.error());
  return forget_unnamed().map([removed] { return removed; });
}

Result<void> AuditLog::forget_unnamed() {
  std::set<std::string> named;
  const auto note = [&](std::string_view line, std::uint64_t) {
    if (const Result<AuditRecord> record = decode_record(line)) named.insert(record->identity);
    return true;
  };
  if (const auto rest = for_each_line(*disk_, file_, note); !rest) return tl::unexpected(rest.error());
  return people_.erase_if([&](const AuditPerson& one) { return !named.contains(one.pseudonym); }).map([](std::size_t) {
  });
}

Result<std::size_t> erase_person(Disk& disk, const fs::path& log, std::string_view person) {
  const fs::path file = people_file_of(log);
  const auto there = disk.identity(file);
  if (!there) return tl::unexpected(there.error());
  if (!*there) return std::size_t{0};
  const auto held = lock(disk, log);
  if (!held) return tl::unexpected(held.error());
  return AuditPeople(disk, file).erase_if([&](const AuditPerson& one) { return is_of(one.who, person); });
}

}  // namespace osteon
