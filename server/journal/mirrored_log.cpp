#include "server/journal/mirrored_log.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "common/core/check.hpp"
#include "common/link/random_bytes.hpp"
#include "server/journal/bytes.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

// A file is a first sector, which says what it belongs to, and entries one after the other. An entry is as long as it
// needs to be: a torn write may spoil the sector in which the last one ends, and then the other file has that one.
// Where the generation has a signer, a signature stands behind the rows of each entry. Journals of version 3 have logs
// without length and signer.
constexpr std::string_view kMagic = "OsteonL2", kMagicOfVersion3 = "OsteonL1";
constexpr std::size_t kFirstSector = 4096, kSaltBytes = 16, kChainBytes = 32, kChecksumBytes = 16;
constexpr std::size_t kSaltEnd = kMagic.size() + kChainBytes + 2 * 8 + kChainBytes + kSaltBytes;
constexpr std::size_t kStartBytes = kSaltEnd + 8 + sizeof(PublicKey) + 8;  // length, key, first signed row
constexpr std::size_t kSignatureBytes = sizeof(Signature);
// No log gets as long: it is carried into the database once it is full, and a commit has few rows.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
constexpr const char* kForeign = "belongs to another journal";
constexpr std::size_t kEntryHead = kSaltBytes + 3 * 8 + kChainBytes;  // salt, bytes of rows, count, first place, chain

std::string checksum(std::string_view bytes) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(bytes)));
  const Digest digest = hasher.finish();
  return {reinterpret_cast<const char*>(digest.bytes.data()), kChecksumBytes};
}

template <class Array>
std::string_view text_of(const Array& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string encode_start(const LogStart& start, std::string_view salt, std::uint64_t length) {
  std::string bytes(kMagic);
  bytes += as_text(start.journal);
  put_integer(bytes, start.generation);
  put_integer(bytes, start.base.place.value);
  bytes += as_text(start.base.chain);
  bytes += salt;
  put_integer(bytes, length);
  const LogStart::Signer signer = start.signer.value_or(LogStart::Signer{});
  bytes += text_of(signer.key.bytes);
  put_integer(bytes, signer.since.value);  // 0: there is none
  return bytes + checksum(bytes);
}

std::string encode_entry(std::span<const JournalRow> rows, const JournalHead& head,
                         const std::optional<Signature>& signature, std::string_view salt) {
  std::string body;
  for (const JournalRow& row : rows) {
    put_integer(body, static_cast<std::uint64_t>(row.at_ns));
    put_integer(body, row.bytes.size());
    body += row.bytes;
  }
  std::string bytes(salt);
  put_integer(bytes, body.size());
  put_integer(bytes, rows.size());
  put_integer(bytes, rows.front().place.value);
  bytes += as_text(head.chain);
  bytes += body;
  if (signature) bytes += text_of(signature->bytes);
  return bytes + checksum(bytes);
}

struct Entry {
  std::uint64_t first = 0;  // place
  JournalHead head;         // after it
  std::vector<JournalRow> rows;
  std::optional<Signature> signature;
};

// The entry at the front of `bytes`, and how long it is. Nothing where no whole and sound one is there.
std::optional<std::pair<Entry, std::size_t>> decode_entry(std::string_view bytes, std::string_view salt,
                                                          bool is_signed) {
  const std::size_t signature = is_signed ? kSignatureBytes : 0, least = kEntryHead + signature + kChecksumBytes;
  if (bytes.size() < least || !bytes.starts_with(salt)) return std::nullopt;
  const std::uint64_t body = integer_at(bytes, kSaltBytes), count = integer_at(bytes, kSaltBytes + 8);
  if (body > bytes.size() - least || count == 0 || count > body) return std::nullopt;
  const std::size_t size = kEntryHead + body + signature;
  if (checksum(bytes.substr(0, size)) != bytes.substr(size, kChecksumBytes)) return std::nullopt;

  Entry entry;
  entry.first = integer_at(bytes, kSaltBytes + 16);
  entry.head = {RoomSeq{entry.first + count - 1}, *digest_of(bytes.substr(kSaltBytes + 24, kChainBytes))};
  std::string_view left = bytes.substr(kEntryHead, body);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (left.size() < 16 || integer_at(left, 8) > left.size() - 16) return std::nullopt;
    const std::uint64_t length = integer_at(left, 8);
    entry.rows.push_back({RoomSeq{entry.first + i}, static_cast<std::int64_t>(integer_at(left, 0)),
                          std::string(left.substr(16, length))});
    left.remove_prefix(16 + length);
  }
  if (!left.empty()) return std::nullopt;
  if (is_signed) std::ranges::copy(bytes.substr(kEntryHead + body, signature), entry.signature.emplace().bytes.begin());
  return std::pair{std::move(entry), size + kChecksumBytes};
}

// What one of the two files holds.
struct FoundFile {
  fs::path path;
  std::string unreadable;         // why nothing of it counts; empty: its start is sound
  LogStart start;
  std::vector<Entry> entries;
  bool is_there = false;
  bool damaged = false;           // something that cannot be read lies between entries
  bool is_cut = false;            // shorter than it was made
  bool ends_in_part = false;      // of an entry
  [[nodiscard]] RoomSeq last() const { return entries.empty() ? start.base.place : entries.back().head.place; }
};

void read_entries(std::string_view bytes, std::string_view salt, FoundFile& file) {
  std::size_t at = kFirstSector;
  while (at < bytes.size()) {
    const bool is_signed = file.start.signer.has_value();
    if (auto entry = decode_entry(bytes.substr(at), salt, is_signed)) {
      at += entry->second;
      file.entries.push_back(std::move(entry->first));
      continue;
    }
    // The bytes here may be what an earlier generation left, part of an entry, or damage with entries behind it.
    std::size_t next = bytes.find(salt, at + 1);
    while (next != bytes.npos && !decode_entry(bytes.substr(next), salt, is_signed)) next = bytes.find(salt, next + 1);
    if (next == bytes.npos) {
      file.ends_in_part = bytes.substr(at).starts_with(salt);
      return;
    }
    file.damaged = true;
    at = next;
  }
}

Result<FoundFile> read_member(const fs::path& path, const Digest& journal, Disk& disk) {
  FoundFile file;
  file.path = path;
  const auto size = disk.size(path);
  if (!size) return tl::unexpected(size.error());
  if (!*size) {
    file.unreadable = "is missing";
    return file;
  }
  file.is_there = true;
  if (**size > kMostBytes) {
    file.unreadable = "is longer than any log";
    return file;
  }
  const auto read = disk.read(path, 0, **size);
  if (!read) return tl::unexpected(read.error());
  const std::string_view bytes(*read);
  const bool of_version_3 = bytes.starts_with(kMagicOfVersion3);
  const std::string_view first = bytes.substr(0, of_version_3 ? kSaltEnd : kStartBytes);
  if ((!of_version_3 && !bytes.starts_with(kMagic)) || bytes.size() < first.size() + kChecksumBytes ||
      bytes.substr(first.size(), kChecksumBytes) != checksum(first)) {
    file.unreadable = "is damaged";
    return file;
  }
  std::size_t at = kMagic.size();
  file.start.journal = *digest_of(first.substr(at, kChainBytes));
  at += kChainBytes;
  file.start.generation = integer_at(first, at);
  file.start.base.place.value = integer_at(first, at + 8);
  file.start.base.chain = *digest_of(first.substr(at + 16, kChainBytes));
  if (file.start.journal != journal) {
    file.unreadable = kForeign;
    return file;
  }
  if (!of_version_3) {
    file.is_cut = bytes.size() < integer_at(first, kSaltEnd);
    LogStart::Signer signer;
    std::ranges::copy(first.substr(kSaltEnd + 8, signer.key.bytes.size()), signer.key.bytes.begin());
    signer.since.value = integer_at(first, kSaltEnd + 8 + signer.key.bytes.size());
    if (signer.since) file.start.signer = signer;
  }
  read_entries(bytes, first.substr(kSaltEnd - kSaltBytes, kSaltBytes), file);
  return file;
}

// The rows of an entry that follow `head`, if they lead to where the entry says. Nothing: it is of another history.
std::optional<std::vector<JournalRow>> rows_after(const Entry& entry, JournalHead head) {
  std::vector<JournalRow> rows;
  for (const JournalRow& row : entry.rows) {
    if (row.place <= head.place) continue;
    head = next_head(head, row);
    rows.push_back(row);
  }
  if (head != entry.head) return std::nullopt;
  return rows;
}

// The entry of a file that goes on from `head`, or nothing.
const Entry* find_next(const FoundFile& file, const JournalHead& head) {
  const auto found = std::ranges::find_if(file.entries, [&](const Entry& entry) {
    return entry.first <= head.place.value + 1 && entry.head.place > head.place;
  });
  return found == file.entries.end() ? nullptr : &*found;
}

// A kill or a power failure leaves the mirror one entry behind the log, or one generation ahead of it and empty. Any
// other distance means that one of them was exchanged for an older copy.
void find_older_copy(FoundFile& log, FoundFile& mirror) {
  if (!log.unreadable.empty() || !mirror.unreadable.empty()) return;
  const std::uint64_t a = log.start.generation, b = mirror.start.generation;
  if (b < a) mirror.unreadable = "is an older copy";
  if (b > a + 1 || (b == a + 1 && !mirror.entries.empty())) log.unreadable = "is an older copy";
}

// What of one file the other makes good, and a write that is not whole.
void note_differences(const FoundFile& log, const FoundFile& mirror, LogContents& found) {
  const auto note = [&](const FoundFile& bad, const FoundFile& good, const std::string& what) {
    found.notes.push_back(bad.path.string() + " " + what + "; its rows were read from " + good.path.string());
  };
  const auto lacks_rows = [&](const FoundFile& one, const FoundFile& other) {
    return std::ranges::any_of(other.entries, [&](const Entry& entry) {
      return entry.head.place <= one.last() && entry.first > one.start.base.place.value &&
             std::ranges::none_of(one.entries, [&](const Entry& own) { return own.head == entry.head; });
    });
  };
  if (!log.unreadable.empty() && !mirror.unreadable.empty()) return;
  if (!log.unreadable.empty()) return note(log, mirror, log.unreadable);
  if (!mirror.unreadable.empty()) return note(mirror, log, mirror.unreadable);
  if (log.is_cut && mirror.is_cut) return;
  if (log.is_cut) return note(log, mirror, "was cut");
  if (mirror.is_cut) return note(mirror, log, "was cut");
  for (const FoundFile* file : {&log, &mirror})
    if (file->ends_in_part)
      found.notes.push_back(file->path.string() + " ends in a write that is not whole");
  if (mirror.start.generation > log.start.generation) return;
  if (log.damaged || log.last() < mirror.last() || lacks_rows(log, mirror)) note(log, mirror, "is damaged");
  const bool one_behind = !log.entries.empty() && mirror.last().value + 1 == log.entries.back().first;
  if (mirror.damaged || (mirror.last() < log.last() && !one_behind) || lacks_rows(mirror, log))
    note(mirror, log, "is damaged");
}

}  // namespace

fs::path log_of(const fs::path& journal) { return journal.string() + "-log"; }
fs::path mirror_of(const fs::path& journal) { return journal.string() + "-mirror"; }

Result<LogContents> read_log(const fs::path& journal, const Digest& identity, const JournalHead& from, Disk& disk) {
  std::array<FoundFile, 2> members;
  for (const bool is_mirror : {false, true}) {
    auto file = read_member(is_mirror ? mirror_of(journal) : log_of(journal), identity, disk);
    if (!file) return tl::unexpected(file.error());
    members[is_mirror ? 1 : 0] = std::move(*file);
  }
  find_older_copy(members[0], members[1]);
  LogContents found;
  found.head = from;
  for (const FoundFile& file : members) {
    if (file.unreadable == kForeign)
      found.foreign.push_back(file.path.string() + " belongs to another journal than " + journal.string());
    if (!file.unreadable.empty()) continue;
    found.generation = std::max(found.generation, file.start.generation);
    found.witnessed = std::max({found.witnessed, file.start.base.place, file.last()});
    found.bases.emplace_back(file.path, file.start.base);
  }
  for (bool more = true; more;) {
    more = false;
    for (const FoundFile& file : members) {
      const Entry* next = file.unreadable.empty() ? find_next(file, found.head) : nullptr;
      if (next == nullptr) continue;
      const auto rows = rows_after(*next, found.head);
      if (!rows) continue;
      found.rows.insert(found.rows.end(), rows->begin(), rows->end());
      found.head = next->head;
      found.signature.reset();
      if (next->signature)
        found.signature = SignedRows{file.start.signer->since, next->head, file.start.signer->key, *next->signature};
      more = true;
      break;
    }
  }
  const bool any = members[0].is_there || members[1].is_there;
  if (any && !members[0].unreadable.empty() && !members[1].unreadable.empty())
    for (const FoundFile& file : members) found.faults.push_back(file.path.string() + " " + file.unreadable);
  const auto is_lost = [](const FoundFile& file) { return !file.unreadable.empty() || file.is_cut; };
  if (found.faults.empty() && is_lost(members[0]) && is_lost(members[1]))
    for (const FoundFile& file : members)
      if (file.is_cut)
        found.faults.push_back(file.path.string() + " was cut, and the other file of the log, too, is not whole");
  if (any) note_differences(members[0], members[1], found);
  const auto &log = members[0], &mirror = members[1];
  const auto cut_short = [](const FoundFile& file) { return file.ends_in_part || file.damaged; };
  if (is_lost(log) != is_lost(mirror))
    found.doubtful = cut_short(is_lost(log) ? mirror : log);
  else
    found.doubtful = log.unreadable.empty() && log.start.generation == mirror.start.generation &&
                     ((log.ends_in_part && mirror.last() < log.last()) ||
                      (mirror.ends_in_part && log.last() <= mirror.last()));
  return found;
}

Result<void> remove_log(const fs::path& journal, Disk& disk) {
  return disk.remove(log_of(journal)).and_then([&] { return disk.remove(mirror_of(journal)); });
}

Result<MirroredLog> MirroredLog::open(const fs::path& journal, std::uint64_t capacity, Disk& disk, bool durable) {
  MirroredLog made(kFirstSector + capacity, disk, durable);
  for (const bool is_mirror : {false, true}) {
    auto member = made.open_member(is_mirror ? mirror_of(journal) : log_of(journal));
    if (!member) return tl::unexpected(member.error());
    (is_mirror ? made.mirror_ : made.log_) = std::move(*member);
  }
  if (Result<void> named = disk.sync_folder(folder_of(journal)); !named) return tl::unexpected(named.error());
  return made;
}

Result<MirroredLog::Member> MirroredLog::open_member(const fs::path& path) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  Member member;
  member.path = path;
  auto file = disk_->open(path);
  if (!file) return tl::unexpected(file.error());
  member.file = std::move(*file);
  const auto identity = disk_->identity(path);
  if (!identity) return tl::unexpected(identity.error());
  if (!*identity) return failure(ErrorCode::internal, path.string() + " was removed while it was opened");
  member.identity = **identity;
  member.written = member.identity.size;
  // Written, not only reserved: the first write to reserved space changes the file system's own records.
  const std::string zeros(kPiece, '\0');
  for (std::uint64_t at = member.identity.size; at < capacity_; at += kPiece) {
    const std::string_view piece = std::string_view(zeros).substr(0, std::min<std::uint64_t>(kPiece, capacity_ - at));
    if (Result<void> put = member.file->write_at(at, piece); !put) return tl::unexpected(put.error());
  }
  if (Result<void> synced = sync(member); !synced) return tl::unexpected(synced.error());
  member.written = std::max(member.written, capacity_);
  return member;
}

Result<void> MirroredLog::check_named(const Member& member) {
  const auto now = disk_->identity(member.path);
  if (!now) return tl::unexpected(now.error());
  if (*now && (*now)->same_file(member.identity) && (*now)->size >= member.written) return {};
  return failure(ErrorCode::internal, member.path.string() + " was " + (*now ? "replaced or cut" : "removed") +
                                          " while its room was open; recover the journal into a new one");
}

Result<void> MirroredLog::begin(Member& member, const LogStart& start) {
  // Nobody can put something into a row that is taken for an entry.
  std::array<std::uint8_t, kSaltBytes> salt{};
  system_random()(salt);
  member.salt.assign(salt.begin(), salt.end());
  member.end = kFirstSector;
  member.is_signed = start.signer.has_value();
  const std::string first = encode_start(start, member.salt, capacity_);
  return check_named(member)
      .and_then([&] { return member.file->write_at(0, first); })
      .and_then([&] { return sync(member); });
}

Result<void> MirroredLog::begin_mirror(const LogStart& start) { return begin(mirror_, start); }
Result<void> MirroredLog::begin_log(const LogStart& start) { return begin(log_, start); }

Result<void> MirroredLog::append(std::span<const JournalRow> rows, const JournalHead& head,
                                 const std::optional<Signature>& signature) {
  OSTEON_CHECK(!rows.empty() && log_.end != 0 && mirror_.end != 0);
  // One after the other: a write that the power cuts short spoils one file at most.
  for (Member* member : {&log_, &mirror_}) {
    OSTEON_CHECK(signature.has_value() == member->is_signed);
    const std::string entry = encode_entry(rows, head, signature, member->salt);
    if (Result<void> named = check_named(*member); !named) return named;
    Result<void> put = durable_ ? member->file->write_durably(member->end, entry)
                                : member->file->write_at(member->end, entry);
    if (!put) return put;
    member->end += entry.size();
    member->written = std::max(member->written, member->end);
  }
  return {};
}

Result<void> MirroredLog::wipe() {
  const std::string zeros(std::size_t{1} << 16, '\0');
  for (Member* member : {&log_, &mirror_}) {
    for (std::uint64_t at = member->end; at < member->written; at += zeros.size()) {
      const std::string_view piece =
          std::string_view(zeros).substr(0, std::min<std::uint64_t>(zeros.size(), member->written - at));
      if (Result<void> put = member->file->write_at(at, piece); !put) return put;
    }
    if (Result<void> synced = sync(*member); !synced) return synced;
  }
  return {};
}

std::uint64_t MirroredLog::used_bytes() const { return log_.end - std::min<std::uint64_t>(log_.end, kFirstSector); }
bool MirroredLog::is_full() const { return log_.end >= capacity_; }

}  // namespace osteon
