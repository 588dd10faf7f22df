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

// A file is a first sector, which says what the file belongs to, and then batches: the entries of one append. A batch
// is not padded. A torn write may spoil the sector in which the previous batch ends, but then the other file has that
// batch. If the generation has a signer, a signature follows the entries of each batch. Logs of journals of version 3
// have no length and no signer.
constexpr std::string_view kMagic = "OsteonL2", kMagicOfVersion3 = "OsteonL1";
constexpr std::size_t kFirstSector = 4096, kSaltBytes = 16, kChainBytes = 32, kChecksumBytes = 16;
constexpr std::size_t kSaltEnd = kMagic.size() + kChainBytes + 2 * 8 + kChainBytes + kSaltBytes;
constexpr std::size_t kStartBytes = kSaltEnd + 8 + sizeof(PublicKey) + 8;  // length, key, first signed entry
constexpr std::size_t kSignatureBytes = sizeof(Signature);
// No log gets this long: a full log is copied into the database, and a commit has few entries.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
constexpr const char* kForeign = "belongs to another journal";
// salt, bytes of entries, count, first sequence number, chain
constexpr std::size_t kBatchHead = kSaltBytes + 3 * 8 + kChainBytes;

std::string checksum(std::string_view bytes) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(bytes)));
  const Digest digest = hasher.finish();
  return {reinterpret_cast<const char*>(digest.bytes.data()), kChecksumBytes};
}

std::string encode_start(const LogStart& start, std::string_view salt, std::uint64_t length) {
  std::string bytes(kMagic);
  bytes += as_text(start.journal);
  put_integer(bytes, start.generation);
  put_integer(bytes, start.base.seq.value);
  bytes += as_text(start.base.chain);
  bytes += salt;
  put_integer(bytes, length);
  const LogStart::Signer signer = start.signer.value_or(LogStart::Signer{});
  bytes += text_of(signer.key.bytes);
  put_integer(bytes, signer.since.value);  // 0: there is none
  return bytes + checksum(bytes);
}

std::string encode_batch(std::span<const JournalEntry> entries, const JournalHead& head,
                         const std::optional<Signature>& signature, std::string_view salt) {
  std::string body;
  for (const JournalEntry& entry : entries) {
    put_integer(body, static_cast<std::uint64_t>(entry.at_ns));
    put_integer(body, entry.bytes.size());
    body += entry.bytes;
  }
  std::string bytes(salt);
  put_integer(bytes, body.size());
  put_integer(bytes, entries.size());
  put_integer(bytes, entries.front().seq.value);
  bytes += as_text(head.chain);
  bytes += body;
  if (signature) bytes += text_of(signature->bytes);
  return bytes + checksum(bytes);
}

struct Batch {
  std::uint64_t first = 0;  // sequence number
  JournalHead head;         // after the batch
  std::vector<JournalEntry> entries;
  std::optional<Signature> signature;
};

// The batch at the front of `bytes`, and its length. Nothing if there is no complete and sound batch.
std::optional<std::pair<Batch, std::size_t>> decode_batch(std::string_view bytes, std::string_view salt,
                                                          bool is_signed) {
  const std::size_t signature = is_signed ? kSignatureBytes : 0, least = kBatchHead + signature + kChecksumBytes;
  if (bytes.size() < least || !bytes.starts_with(salt)) return std::nullopt;
  const std::uint64_t body = integer_at(bytes, kSaltBytes), count = integer_at(bytes, kSaltBytes + 8);
  if (body > bytes.size() - least || count == 0 || count > body) return std::nullopt;
  const std::size_t size = kBatchHead + body + signature;
  if (checksum(bytes.substr(0, size)) != bytes.substr(size, kChecksumBytes)) return std::nullopt;

  Batch batch;
  batch.first = integer_at(bytes, kSaltBytes + 16);
  batch.head = {RoomSeq{batch.first + count - 1}, *digest_of(bytes.substr(kSaltBytes + 24, kChainBytes))};
  std::string_view left = bytes.substr(kBatchHead, body);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (left.size() < 16 || integer_at(left, 8) > left.size() - 16) return std::nullopt;
    const std::uint64_t length = integer_at(left, 8);
    batch.entries.push_back({RoomSeq{batch.first + i}, static_cast<std::int64_t>(integer_at(left, 0)),
                             std::string(left.substr(16, length))});
    left.remove_prefix(16 + length);
  }
  if (!left.empty()) return std::nullopt;
  if (is_signed) std::ranges::copy(bytes.substr(kBatchHead + body, signature), batch.signature.emplace().bytes.begin());
  return std::pair{std::move(batch), size + kChecksumBytes};
}

// The content of one of the two files.
struct FoundFile {
  fs::path path;
  std::string unreadable;  // why nothing of it counts; empty: its start is sound
  LogStart start;
  std::vector<Batch> batches;
  bool is_there = false;
  bool damaged = false;       // something unreadable lies between batches
  bool is_cut = false;        // shorter than it was made
  bool ends_in_part = false;  // with part of a batch
  [[nodiscard]] RoomSeq last() const { return batches.empty() ? start.base.seq : batches.back().head.seq; }
};

void read_batches(std::string_view bytes, std::string_view salt, FoundFile& file) {
  std::size_t at = kFirstSector;
  while (at < bytes.size()) {
    const bool is_signed = file.start.signer.has_value();
    if (auto batch = decode_batch(bytes.substr(at), salt, is_signed)) {
      at += batch->second;
      file.batches.push_back(std::move(batch->first));
      continue;
    }
    // These bytes may be remains of an earlier generation, part of a batch, or damage with batches after it.
    std::size_t next = bytes.find(salt, at + 1);
    while (next != bytes.npos && !decode_batch(bytes.substr(next), salt, is_signed)) next = bytes.find(salt, next + 1);
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
  file.start.base.seq.value = integer_at(first, at + 8);
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
  read_batches(bytes, first.substr(kSaltEnd - kSaltBytes, kSaltBytes), file);
  return file;
}

// The entries of a batch that follow `head`, if they lead to the head of the batch. Nothing: another history.
std::optional<std::vector<JournalEntry>> entries_after(const Batch& batch, JournalHead head) {
  std::vector<JournalEntry> entries;
  for (const JournalEntry& entry : batch.entries) {
    if (entry.seq <= head.seq) continue;
    head = next_head(head, entry);
    entries.push_back(entry);
  }
  if (head != batch.head) return std::nullopt;
  return entries;
}

// The batch of a file that continues from `head`, or null.
const Batch* find_next(const FoundFile& file, const JournalHead& head) {
  const auto found = std::ranges::find_if(
      file.batches, [&](const Batch& batch) { return batch.first <= head.seq.value + 1 && batch.head.seq > head.seq; });
  return found == file.batches.end() ? nullptr : &*found;
}

// After a kill or a power failure, the mirror may be one batch behind the log, or one generation ahead of it and empty.
// Any other difference means that one of them was replaced by an older copy.
void find_older_copy(FoundFile& log, FoundFile& mirror) {
  if (!log.unreadable.empty() || !mirror.unreadable.empty()) return;
  const std::uint64_t a = log.start.generation, b = mirror.start.generation;
  if (b < a) mirror.unreadable = "is an older copy";
  if (b > a + 1 || (b == a + 1 && !mirror.batches.empty())) log.unreadable = "is an older copy";
}

// Notes what one file lacks and the other has, and incomplete writes.
void note_differences(const FoundFile& log, const FoundFile& mirror, LogContents& found) {
  const auto note = [&](const FoundFile& bad, const FoundFile& good, const std::string& what) {
    found.notes.push_back(bad.path.string() + " " + what + "; its entries were read from " + good.path.string());
  };
  const auto lacks_batches = [&](const FoundFile& one, const FoundFile& other) {
    return std::ranges::any_of(other.batches, [&](const Batch& batch) {
      return batch.head.seq <= one.last() && batch.first > one.start.base.seq.value &&
             std::ranges::none_of(one.batches, [&](const Batch& own) { return own.head == batch.head; });
    });
  };
  if (!log.unreadable.empty() && !mirror.unreadable.empty()) return;
  if (!log.unreadable.empty()) return note(log, mirror, log.unreadable);
  if (!mirror.unreadable.empty()) return note(mirror, log, mirror.unreadable);
  if (log.is_cut && mirror.is_cut) return;
  if (log.is_cut) return note(log, mirror, "was cut");
  if (mirror.is_cut) return note(mirror, log, "was cut");
  for (const FoundFile* file : {&log, &mirror})
    if (file->ends_in_part) found.notes.push_back(file->path.string() + " ends in an incomplete write");
  if (mirror.start.generation > log.start.generation) return;
  if (log.damaged || log.last() < mirror.last() || lacks_batches(log, mirror)) note(log, mirror, "is damaged");
  const bool one_behind = !log.batches.empty() && mirror.last().value + 1 == log.batches.back().first;
  if (mirror.damaged || (mirror.last() < log.last() && !one_behind) || lacks_batches(mirror, log))
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
    found.witnessed = std::max({found.witnessed, file.start.base.seq, file.last()});
    found.bases.emplace_back(file.path, file.start.base);
  }
  for (bool more = true; more;) {
    more = false;
    for (const FoundFile& file : members) {
      const Batch* next = file.unreadable.empty() ? find_next(file, found.head) : nullptr;
      if (next == nullptr) continue;
      const auto entries = entries_after(*next, found.head);
      if (!entries) continue;
      found.entries.insert(found.entries.end(), entries->begin(), entries->end());
      found.head = next->head;
      found.signature.reset();
      if (next->signature)
        found.signature = SignedEntries{file.start.signer->since, next->head, file.start.signer->key, *next->signature};
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
        found.faults.push_back(file.path.string() + " was cut, and the other file of the log is incomplete, too");
  if (any) note_differences(members[0], members[1], found);
  const auto &log = members[0], &mirror = members[1];
  const auto cut_short = [](const FoundFile& file) { return file.ends_in_part || file.damaged; };
  if (is_lost(log) != is_lost(mirror))
    found.doubtful = cut_short(is_lost(log) ? mirror : log);
  else
    found.doubtful =
        log.unreadable.empty() && log.start.generation == mirror.start.generation &&
        ((log.ends_in_part && mirror.last() < log.last()) || (mirror.ends_in_part && log.last() <= mirror.last()));
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
  // The bytes are written, not only reserved: the first write to reserved space changes the metadata of the file
  // system.
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
                                          " while its room was open; salvage the journal into a new one");
}

Result<void> MirroredLog::begin(Member& member, const LogStart& start) {
  // With a random salt, nobody can put bytes into an entry that are mistaken for a batch.
  std::array<std::uint8_t, kSaltBytes> salt{};
  system_random()(salt);
  member.salt.assign(salt.begin(), salt.end());
  member.end = kFirstSector;
  member.is_signed = start.signer.has_value();
  const std::string first = encode_start(start, member.salt, capacity_);
  return check_named(member).and_then([&] { return member.file->write_at(0, first); }).and_then([&] {
    return sync(member);
  });
}

Result<void> MirroredLog::begin_mirror(const LogStart& start) { return begin(mirror_, start); }
Result<void> MirroredLog::begin_log(const LogStart& start) { return begin(log_, start); }

Result<void> MirroredLog::append(std::span<const JournalEntry> entries, const JournalHead& head,
                                 const std::optional<Signature>& signature) {
  OSTEON_CHECK(!entries.empty() && log_.end != 0 && mirror_.end != 0);
  // One after the other, so that a write that a power failure cuts short spoils one file at most.
  for (Member* member : {&log_, &mirror_}) {
    OSTEON_CHECK(signature.has_value() == member->is_signed);
    const std::string batch = encode_batch(entries, head, signature, member->salt);
    if (Result<void> named = check_named(*member); !named) return named;
    Result<void> put =
        durable_ ? member->file->write_durably(member->end, batch) : member->file->write_at(member->end, batch);
    if (!put) return put;
    member->end += batch.size();
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
