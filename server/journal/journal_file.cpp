#include "server/journal/journal_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <utility>

#include "common/core/check.hpp"
#include "common/link/random_bytes.hpp"
#include "server/journal/bytes.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kApplication = 0x4f73744a;  // "OstJ"
constexpr std::string_view kRemedy = "; salvage it into a new journal";

// The tables of each version, and the query that reads its entries like those of today. A new version gets a Version of
// its own. The queries of older versions add the columns that these did not have.
struct Version {
  int number;
  std::string tables;
  const char* entries;
};

#define OSTEON_OTHER_TABLES                                                                                        \
  "CREATE TABLE registers(name TEXT PRIMARY KEY, value BLOB NOT NULL, seal BLOB NOT NULL) STRICT, WITHOUT ROWID;"  \
  "CREATE TABLE checkpoints(place INTEGER PRIMARY KEY, chain BLOB NOT NULL, meta BLOB NOT NULL, size INTEGER NOT " \
  "NULL,"                                                                                                          \
  " digest BLOB NOT NULL, seal BLOB NOT NULL) STRICT;"                                                             \
  "CREATE TABLE people(pseudonym TEXT PRIMARY KEY, label TEXT NOT NULL, joined_day INTEGER NOT NULL,"              \
  " seal BLOB NOT NULL) STRICT, WITHOUT ROWID;"

constexpr const char* kTimedTables =
    "CREATE TABLE rows(place INTEGER PRIMARY KEY, at_ns INTEGER NOT NULL, bytes BLOB NOT NULL,"
    " chain BLOB NOT NULL) STRICT;" OSTEON_OTHER_TABLES;
constexpr const char* kSignatureTable =
    "CREATE TABLE signatures(place INTEGER PRIMARY KEY, since INTEGER NOT NULL, chain BLOB NOT NULL, key BLOB NOT NULL,"
    " signature BLOB NOT NULL) STRICT;";
constexpr int kVersionWithSignatures = 4;
constexpr const char* kTimedEntries =
    "SELECT place, at_ns, bytes, chain FROM rows WHERE place > ? AND place <= ? ORDER BY place";

const std::array kVersions{
    Version{1,
            "CREATE TABLE rows(place INTEGER PRIMARY KEY, bytes BLOB NOT NULL, chain BLOB NOT NULL) "
            "STRICT;" OSTEON_OTHER_TABLES,
            "SELECT place, 0, bytes, chain FROM rows WHERE place > ? AND place <= ? ORDER BY place"},
    Version{2, kTimedTables, kTimedEntries}, Version{3, kTimedTables, kTimedEntries},
    Version{kJournalVersion, std::string(kTimedTables) + kSignatureTable, kTimedEntries}};

const Version& version_of(int number) {
  return *std::find_if(kVersions.begin(), kVersions.end(), [&](const Version& v) { return v.number == number; });
}

constexpr const char* kInsertEntry = "INSERT INTO rows(place, at_ns, bytes, chain) VALUES(?, ?, ?, ?)";

Result<void> copy_file(Disk& disk, const fs::path& from, const fs::path& to) {
  std::unique_ptr<DiskFile> copy;
  return read_in_pieces(disk, from,
                        [&](std::string_view piece) -> Result<void> {
                          if (copy == nullptr) {
                            auto made = disk.create(to);
                            if (!made) return tl::unexpected(made.error());
                            copy = std::move(*made);
                          }
                          return copy->write(piece);
                        })
      .map([](const WrittenFile&) {});
}

// The chain does not cover what is stored beside it. A seal confirms each such value.
Digest seal_of(const Checkpoint& checkpoint) {
  Hasher hasher;
  hasher.text("checkpoint");
  hasher.integer(checkpoint.at.seq.value);
  hasher.text(as_text(checkpoint.at.chain));
  hasher.text(checkpoint.meta);
  hasher.integer(checkpoint.size);
  hasher.text(as_text(checkpoint.digest));
  return hasher.finish();
}

Digest seal_of(const Person& person) {
  Hasher hasher;
  hasher.text("person");
  hasher.text(person.pseudonym);
  hasher.text(person.label);
  hasher.integer(static_cast<std::uint64_t>(person.joined_day));
  return hasher.finish();
}

Digest seal_of(std::string_view name, std::string_view value) {
  Hasher hasher;
  hasher.text("register");
  hasher.text(name);
  hasher.text(value);
  return hasher.finish();
}

}  // namespace

fs::path wal_of(const fs::path& journal) { return journal.string() + "-wal"; }
fs::path owner_file_of(const fs::path& journal) { return journal.string() + "-owner"; }
fs::path failed_of(const fs::path& journal) { return journal.string() + ".failed"; }

fs::path checkpoint_file(const fs::path& journal, const JournalHead& at) {
  return journal.string() + "-" + std::to_string(at.seq.value) + "-" + to_hex(at.chain) + ".checkpoint";
}

std::optional<JournalHead> parse_checkpoint_file(const fs::path& journal, std::string_view name) {
  const std::string before = journal.filename().string() + "-";
  constexpr std::string_view kAfter = ".checkpoint";
  if (!name.starts_with(before) || !name.ends_with(kAfter)) return std::nullopt;
  name = name.substr(before.size(), name.size() - before.size() - kAfter.size());
  JournalHead head;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), head.seq.value);
  if (error != std::errc{} || end == name.data() + name.size() || *end != '-') return std::nullopt;
  const auto chain = digest_from_hex(name.substr(static_cast<std::size_t>(end - name.data()) + 1));
  if (!chain) return std::nullopt;
  head.chain = *chain;
  return head;
}

bool is_partial_of(const fs::path& journal, std::string_view name) {
  if (name == wal_of(journal.string() + std::string(kPartial)).filename()) return true;
  if (!name.ends_with(kPartial)) return false;
  name.remove_suffix(kPartial.size());
  return name == journal.filename() || name == wal_of(journal).filename() || name == failed_of(journal).filename() ||
         parse_checkpoint_file(journal, name);
}

// SQLite takes an empty file for a new database, and deletes the log beside it. If the power failed while the log was
// copied into the file, the first page may be lost although the log still has it. Then SQLite has to judge.
Result<void> check_is_journal(const fs::path& file, Disk& disk) {
  constexpr std::size_t kSmallestPage = 512, kLooked = std::size_t{64} << 10, kApplicationAt = 68;
  constexpr std::string_view kMagic("SQLite format 3\0", 16), kOwn("OstJ"),
      kEntries("CREATE TABLE rows(place INTEGER PRIMARY KEY");
  const auto size = disk.size(file);
  if (!size) return tl::unexpected(size.error());
  if (!*size) return failure(ErrorCode::not_found, "there is no journal " + file.string());
  const auto start = disk.read(file, 0, kLooked);
  if (!start) return tl::unexpected(start.error());
  const auto is_not = [&](const std::string& what) { return failure(ErrorCode::invalid_input, file.string() + what); };
  if (start->empty()) return is_not(" is empty, which no journal is; go on from a backup, or name another file");

  const std::string_view page(*start);
  const bool of_sqlite = page.starts_with(kMagic) || kMagic.starts_with(page);
  if (of_sqlite && page.size() < kSmallestPage)
    return is_not(" has been cut to " + std::to_string(page.size()) + " bytes, less than a page; go on from a backup");
  if (page.find(kEntries) != page.npos || (of_sqlite && page.substr(kApplicationAt, kOwn.size()) == kOwn)) return {};
  if (of_sqlite) return is_not(" is a database of another program, no journal; name a journal");
  const auto wal = disk.size(wal_of(file));
  if (!wal) return tl::unexpected(wal.error());
  if (*wal && **wal > 0 && page.size() >= kSmallestPage) return {};
  return is_not(
      " is no journal; name a file that osteon-server keeps a room in, or, where it was one, go on from a backup");
}

bool belongs_to(const fs::path& journal, std::string_view name) {
  const std::string own = journal.filename().string();
  if (!name.starts_with(own)) return false;
  // A lock of earlier versions. The last two are SQLite's, present if another program opened the file.
  for (const std::string_view end : {"", "-log", "-mirror", "-owner", "-wal", ".failed", ".lock", "-shm", "-journal"})
    if (name == own + std::string(end)) return true;
  return is_partial_of(journal, name) || parse_checkpoint_file(journal, name);
}

std::string encode_number(std::uint64_t number) {
  std::string bytes;
  put_integer(bytes, number);
  return bytes;
}

std::optional<std::uint64_t> decode_number(std::string_view bytes) {
  if (bytes.size() != 8) return std::nullopt;
  return integer_at(bytes, 0);
}

std::string encode_footer(const Footer& footer) {
  return encode_number(footer.head.seq.value) + std::string(as_text(footer.head.chain)) + (footer.clean ? '\1' : '\0');
}

std::optional<Footer> decode_footer(std::string_view bytes) {
  if (bytes.size() != 41) return std::nullopt;
  return Footer{{RoomSeq{*decode_number(bytes.substr(0, 8))}, *digest_of(bytes.substr(8, 32))}, bytes[40] != '\0'};
}

Result<void> JournalFile::make(const fs::path& file, std::string_view genesis, Disk& disk,
                               const DatabaseOptions& options) {
  auto database = Database::open(file, disk, options);
  if (!database) return tl::unexpected(database.error());
  const Result<std::string> mode = database->text("PRAGMA journal_mode");
  if (!mode) return tl::unexpected(mode.error());
  if (*mode != "wal")
    return failure(ErrorCode::internal, file.string() + ": SQLite cannot keep a write-ahead log here");
  JournalFile made(file, disk, std::move(*database));
  Database& own = made.database_;
  return own.begin()
      .and_then([&] {
        return own.run(version_of(kJournalVersion).tables + "PRAGMA application_id=" + std::to_string(kApplication) +
                       "; PRAGMA user_version=" + std::to_string(kJournalVersion) + ";");
      })
      .and_then([&] { return made.set_register(kGenesisRegister, genesis); })
      .and_then([&] { return own.commit(); })
      .and_then([&] { return own.carry_log(); });
}

Result<JournalFile> JournalFile::open(const fs::path& file, Disk& disk, const DatabaseOptions& options) {
  if (Result<void> may_be = check_is_journal(file, disk); !may_be) return tl::unexpected(may_be.error());
  auto database = Database::open(file, disk, options);
  if (!database) return tl::unexpected(database.error());
  return of_database(file, disk, std::move(*database), false);
}

// A database whose own file is complete is read in place. Any other would have to be written to.
Result<JournalFile> JournalFile::open_to_read(const fs::path& file, Disk& disk) {
  if (Result<void> may_be = check_is_journal(file, disk); !may_be) return tl::unexpected(may_be.error());
  // In this mode SQLite does not check the bytes that say that the database has a log.
  constexpr std::string_view kKeepsLog = "\2\2";
  constexpr std::uint64_t kKeepsLogAt = 18;
  const auto versions = disk.read(file, kKeepsLogAt, kKeepsLog.size());
  if (!versions) return tl::unexpected(versions.error());
  bool whole = *versions == kKeepsLog;
  for (const fs::path& beside : {wal_of(file), log_of(file), mirror_of(file)}) {
    const auto size = disk.size(beside);
    if (!size) return tl::unexpected(size.error());
    whole = whole && size->value_or(0) == 0;
  }
  if (whole) {
    auto database = Database::open(file, disk, {.peek = true});
    if (!database) return tl::unexpected(database.error());
    return of_database(file, disk, std::move(*database), true);
  }
  auto scratch = disk.scratch_folder();
  if (!scratch) return tl::unexpected(scratch.error());
  const fs::path copy = (*scratch)->path() / "journal";
  for (const auto& [from, to] : {std::pair{file, copy}, std::pair{wal_of(file), wal_of(copy)}})
    if (Result<void> copied = copy_file(disk, from, to); !copied && copied.error().code != ErrorCode::not_found)
      return tl::unexpected(copied.error());
  auto database = Database::open(copy, disk, {.durable = false, .shown_as = file});
  if (!database) return tl::unexpected(database.error());
  auto opened = of_database(file, disk, std::move(*database), false);
  if (opened) opened->scratch_ = std::move(*scratch);
  return opened;
}

Result<JournalFile> JournalFile::of_database(const fs::path& file, Disk& disk, Database database, bool peek) {
  JournalFile opened(file, disk, std::move(database));
  if (Result<void> known = opened.check_tables(peek); !known) return tl::unexpected(known.error());
  const auto genesis = opened.find_register(kGenesisRegister);
  if (!genesis) return tl::unexpected(genesis.error());
  if (!*genesis)
    return failure(ErrorCode::invalid_input,
                   file.string() + " has lost its register genesis, so no entry of it can be confirmed");
  opened.genesis_ = **genesis;
  const auto generation = opened.find_register(kGenerationRegister), footer = opened.find_register(kFooterRegister);
  const auto id = opened.find_register(kIdRegister);
  if (id && *id) opened.id_ = **id;
  static_cast<void>(opened.read_erased());  // inspect() reports what is wrong with it
  if (generation && *generation) opened.generation_ = decode_number(**generation).value_or(0);
  const auto closed = footer && *footer ? decode_footer(**footer) : std::nullopt;
  opened.needs_log_ = opened.generation_ != 0 && !(closed && closed->clean);
  if (peek) return opened;
  if (Result<void> taken = opened.database_.begin().and_then([&] { return opened.take_log(); }); !taken)
    return tl::unexpected(taken.error());
  return opened;
}

Digest JournalFile::identity() const {
  Hasher hasher;
  hasher.text(as_text(first_head(genesis_).chain));
  hasher.text(id_);
  return hasher.finish();
}

Result<void> JournalFile::make_id() {
  if (!id_.empty()) return {};
  std::array<std::uint8_t, 16> id{};
  system_random()(id);
  id_.assign(id.begin(), id.end());
  return set_register(kIdRegister, id_);
}

Result<JournalHead> JournalFile::stored_head() {
  auto statement = database_.prepare("SELECT place, chain FROM rows ORDER BY place DESC LIMIT 1");
  if (!statement) return tl::unexpected(statement.error());
  const Result<bool> entry = statement->step();
  if (!entry) return tl::unexpected(entry.error());
  if (!*entry) return first_head(genesis_);
  return JournalHead{RoomSeq{static_cast<std::uint64_t>(statement->integer(0))},
                     digest_of(statement->bytes(1)).value_or(Digest{})};
}

Result<void> JournalFile::take_log() {
  const auto stored = stored_head();
  if (!stored) {  // inspect() reports what is wrong with the entries
    log_.faults.push_back(stored.error().message);
    return {};
  }
  stored_head_ = *stored;
  auto read = read_log(file_, identity(), *stored, *disk_);
  if (!read) return tl::unexpected(read.error());
  log_ = std::move(*read);
  for (const auto& [path, base] : log_.bases) {
    if (base.seq > stored->seq) continue;  // inspect() counts what is missing between
    const auto chain = chain_at(base.seq);
    if (chain && *chain == base.chain) continue;
    log_.faults.push_back(path.string() + " continues another history than " + file_.string() + " has");
    needs_log_ = true;
  }
  if (log_.entries.empty() || version_ == 1) return {};
  JournalHead head = *stored;
  const Result<void> added = add_entries(log_.entries, head);
  if (added) return {};
  // The tables are damaged. Only what can be read from them is available.
  log_.faults.push_back(added.error().message);
  needs_log_ = true;
  return database_.run("ROLLBACK").and_then([&] { return database_.begin(); });
}

Result<JournalFile> JournalFile::peek(const fs::path& file, Disk& disk) {
  if (Result<void> may_be = check_is_journal(file, disk); !may_be) return tl::unexpected(may_be.error());
  auto database = Database::open(file, disk, {.peek = true});
  if (!database) return tl::unexpected(database.error());
  const Result<std::int64_t> application = database->integer("PRAGMA application_id");
  if (!application) return tl::unexpected(application.error());
  if (*application != kApplication) return failure(ErrorCode::invalid_input, file.string() + " is no journal");
  JournalFile peeked(file, disk, std::move(*database));
  if (Result<void> known = peeked.read_version(); !known) return tl::unexpected(known.error());
  auto genesis = peeked.find_register(kGenesisRegister);
  if (!genesis) return tl::unexpected(genesis.error());
  if (!*genesis) return peeked.damaged("its register genesis");
  peeked.genesis_ = std::move(**genesis);
  return peeked;
}

tl::unexpected<Error> JournalFile::damaged(const std::string& what) const {
  return failure(ErrorCode::invalid_input, file_.string() + ": " + what + " is damaged" + std::string(kRemedy));
}

Result<void> JournalFile::read_version() {
  const Result<std::int64_t> version = database_.integer("PRAGMA user_version");
  if (!version) return tl::unexpected(version.error());
  if (std::none_of(kVersions.begin(), kVersions.end(), [&](const Version& known) { return known.number == *version; }))
    return failure(ErrorCode::unsupported, file_.string() + " is a journal of version " + std::to_string(*version) +
                                               ", this program reads up to version " + std::to_string(kJournalVersion) +
                                               "; open it with the program that made it");
  version_ = static_cast<int>(*version);
  return {};
}

Result<void> JournalFile::check_tables(bool peek) {
  const Result<std::int64_t> application = database_.integer("PRAGMA application_id");
  if (!application) return tl::unexpected(application.error());
  const Result<std::string> mode = peek ? Result<std::string>("wal") : database_.text("PRAGMA journal_mode");
  if (!mode) return tl::unexpected(mode.error());
  if (*application != kApplication || *mode != "wal")
    return failure(ErrorCode::invalid_input,
                   file_.string() + " is no journal, or its first page is damaged; go on from a backup");
  if (Result<void> known = read_version(); !known) return known;
  if (!peek && database_.read_only())  // no permission to write, or a first page that claims a future version
    return failure(ErrorCode::invalid_input,
                   file_.string() + " cannot be written to; see to its permissions, or salvage it");

  // A damaged definition could make SQLite read the right bytes wrongly.
  const Result<std::string> tables =
      database_.text("SELECT group_concat(sql, ';') || ';' FROM (SELECT sql FROM sqlite_schema ORDER BY rowid)");
  if (!tables) return tl::unexpected(tables.error());
  if (*tables == version_of(version_).tables) return {};
  return damaged("the definition of its tables of version " + std::to_string(version_));
}

Walk JournalFile::walk(const JournalHead& before, RoomSeq last,
                       const std::function<bool(const JournalEntry&, const JournalHead&)>& take) {
  Walk walked{before, std::nullopt};
  auto statement = database_.prepare(version_of(version_).entries);
  if (!statement) {
    walked.stopped = statement.error();
    return walked;
  }
  statement->integer(0, static_cast<std::int64_t>(before.seq.value)).integer(1, static_cast<std::int64_t>(last.value));
  JournalEntry entry;
  while (walked.head.seq < last) {
    const Result<bool> more = statement->step();
    if (!more) {
      walked.stopped = more.error();
      walked.stopped->message = "after entry " + std::to_string(walked.head.seq.value) + ": " + more.error().message;
      return walked;
    }
    if (!*more) return walked;
    entry.seq.value = static_cast<std::uint64_t>(statement->integer(0));
    entry.at_ns = statement->integer(1);
    entry.bytes = statement->bytes(2);
    const JournalHead next = next_in_chain(walked.head, entry);
    if (entry.seq.value != walked.head.seq.value + 1 || statement->bytes(3) != as_text(next.chain)) {
      walked.stopped =
          Error{ErrorCode::invalid_input, file_.string() + ": entry " + std::to_string(walked.head.seq.value + 1) +
                                              " does not fit the chain of hashes" + std::string(kRemedy)};
      return walked;
    }
    walked.head = next;
    if (!take(entry, next)) return walked;
  }
  return walked;
}

Result<std::optional<Digest>> JournalFile::chain_at(RoomSeq seq) {
  if (seq.value == 0) return first_head(genesis_).chain;
  auto statement = database_.prepare("SELECT chain FROM rows WHERE place = ?");
  if (!statement) return tl::unexpected(statement.error());
  const Result<bool> entry = statement->integer(0, static_cast<std::int64_t>(seq.value)).step();
  if (!entry) return tl::unexpected(entry.error());
  if (!*entry) return std::nullopt;
  return digest_of(statement->bytes(0));
}

Result<std::vector<Checkpoint>> JournalFile::checkpoints() {
  std::vector<Checkpoint> all;
  auto statement =
      database_.prepare("SELECT place, chain, meta, size, digest, seal FROM checkpoints ORDER BY place DESC");
  if (!statement) return tl::unexpected(statement.error());
  for (;;) {
    const Result<bool> more = statement->step();
    if (!more) return tl::unexpected(more.error());
    if (!*more) return all;
    Checkpoint checkpoint;
    checkpoint.at.seq.value = static_cast<std::uint64_t>(statement->integer(0));
    const auto chain = digest_of(statement->bytes(1)), digest = digest_of(statement->bytes(4));
    checkpoint.at.chain = chain.value_or(Digest{});
    checkpoint.meta = statement->bytes(2);
    checkpoint.size = static_cast<std::uint64_t>(statement->integer(3));
    checkpoint.digest = digest.value_or(Digest{});
    checkpoint.seal = statement->bytes(5);
    if (!chain || !digest || !check_seal(checkpoint.seal, seal_of(checkpoint), first_head(genesis_).chain))
      return damaged("the record of the checkpoint at event " + std::to_string(checkpoint.at.seq.value));
    all.push_back(std::move(checkpoint));
  }
}

Result<std::vector<Person>> JournalFile::people(std::vector<std::optional<PublicKey>>* signers) {
  std::vector<Person> all;
  auto statement = database_.prepare("SELECT pseudonym, label, joined_day, seal FROM people ORDER BY pseudonym");
  if (!statement) return tl::unexpected(statement.error());
  for (;;) {
    const Result<bool> more = statement->step();
    if (!more) return tl::unexpected(more.error());
    if (!*more) return all;
    Person person{std::string(statement->bytes(0)), std::string(statement->bytes(1)),
                  static_cast<std::int32_t>(statement->integer(2))};
    const auto seal = check_seal(statement->bytes(3), seal_of(person), first_head(genesis_).chain);
    if (!seal) return damaged("the record of a person");
    if (signers != nullptr) signers->push_back(seal->key);
    all.push_back(std::move(person));
  }
}

Result<std::vector<std::string>> JournalFile::registers() {
  std::vector<std::string> names;
  auto statement =
      database_.prepare("SELECT name FROM registers WHERE name NOT IN ('genesis', 'footer') ORDER BY name");
  if (!statement) return tl::unexpected(statement.error());
  for (;;) {
    const Result<bool> more = statement->step();
    if (!more) return tl::unexpected(more.error());
    if (!*more) return names;
    names.emplace_back(statement->bytes(0));
  }
}

Result<std::optional<std::string>> JournalFile::find_register(std::string_view name) {
  return find_sealed(name).map([](std::optional<SealedRegister> found) {
    return found ? std::optional(std::move(found->value)) : std::nullopt;
  });
}

Result<std::optional<SealedRegister>> JournalFile::find_sealed(std::string_view name) {
  auto statement = database_.prepare("SELECT value, seal FROM registers WHERE name = ?");
  if (!statement) return tl::unexpected(statement.error());
  const Result<bool> stored = statement->text(0, name).step();
  if (!stored) return tl::unexpected(stored.error());
  if (!*stored) return std::nullopt;
  SealedRegister found{std::string(name), std::string(statement->bytes(0)), std::string(statement->bytes(1))};
  // All other seals depend on the genesis, and the chain itself covers it.
  const Digest entry = seal_of(name, found.value), genesis = first_head(genesis_).chain;
  const bool fits =
      name == kGenesisRegister ? found.seal == as_text(entry) : check_seal(found.seal, entry, genesis).has_value();
  if (!fits) return damaged("its register " + std::string(name));
  return found;
}

std::optional<PublicKey> JournalFile::signer_of(const SealedRegister& found) const {
  return check_seal(found.seal, seal_of(found.name, found.value), first_head(genesis_).chain).value_or(Seal{}).key;
}

std::optional<PublicKey> JournalFile::signer_of(const Checkpoint& found) const {
  return check_seal(found.seal, seal_of(found), first_head(genesis_).chain).value_or(Seal{}).key;
}

Result<std::vector<SignedEntries>> JournalFile::signed_entries() {
  std::vector<SignedEntries> all;
  if (version_ >= kVersionWithSignatures) {
    auto statement = database_.prepare("SELECT place, since, chain, key, signature FROM signatures ORDER BY place");
    if (!statement) return tl::unexpected(statement.error());
    for (;;) {
      const Result<bool> more = statement->step();
      if (!more) return tl::unexpected(more.error());
      if (!*more) break;
      SignedEntries& one = all.emplace_back();
      one.head.seq.value = static_cast<std::uint64_t>(statement->integer(0));
      one.since.value = static_cast<std::uint64_t>(statement->integer(1));
      const auto chain = digest_of(statement->bytes(2));
      const std::string_view key = statement->bytes(3), signature = statement->bytes(4);
      if (!chain || key.size() != one.key.bytes.size() || signature.size() != one.signature.bytes.size())
        return damaged("the signature at event " + std::to_string(one.head.seq.value));
      one.head.chain = *chain;
      std::ranges::copy(key, one.key.bytes.begin());
      std::ranges::copy(signature, one.signature.bytes.begin());
    }
  }
  if (log_.signature) all.push_back(*log_.signature);
  return all;
}

Result<void> JournalFile::add_signed_entries(const SignedEntries& entries) {
  auto statement =
      database_.prepare("INSERT OR REPLACE INTO signatures(place, since, chain, key, signature) VALUES(?, ?, ?, ?, ?)");
  if (!statement) return tl::unexpected(statement.error());
  return statement->integer(0, static_cast<std::int64_t>(entries.head.seq.value))
      .integer(1, static_cast<std::int64_t>(entries.since.value))
      .blob(2, as_text(entries.head.chain))
      .blob(3, text_of(entries.key.bytes))
      .blob(4, text_of(entries.signature.bytes))
      .run();
}

// Only the caller can judge whose key it is.
void JournalFile::inspect_signatures(Inspection& found) {
  const auto all = signed_entries();
  if (!all) {
    found.faults.push_back(all.error().message);
    return;
  }
  for (const SignedEntries& one : *all) {
    const std::string what = "the signature at event " + std::to_string(one.head.seq.value);
    if (!fits(one))
      found.faults.push_back(damaged(what).value().message);
    else
      check_witness(one.head, what, found);
  }
}

void JournalFile::check_witness(const JournalHead& witness, const std::string& what, Inspection& found) {
  found.witnessed = std::max(found.witnessed, witness.seq);
  if (witness.seq > found.head.seq) {
    const std::uint64_t missing = witness.seq.value - found.head.seq.value;
    found.faults.push_back(file_.string() + " goes to event " + std::to_string(found.head.seq.value) + ", but " + what +
                           " vouches for event " + std::to_string(witness.seq.value) + ": " + std::to_string(missing) +
                           (missing == 1 ? " entry is missing" : " entries are missing") + std::string(kRemedy));
    return;
  }
  const auto chain = chain_at(witness.seq);
  if (!chain) {
    found.faults.push_back(chain.error().message);
  } else if (*chain != witness.chain) {
    found.faults.push_back(file_.string() + ": " + what + " vouches for another history up to event " +
                           std::to_string(witness.seq.value) + std::string(kRemedy));
  }
}

Inspection JournalFile::inspect(bool files) {
  Inspection found;
  const auto note = [&](const Error& error) { found.faults.push_back(error.message); };

  // Pages first: all entries may be there while the tree above them is damaged. The next append would make that worse.
  const Result<std::string> pages = database_.text("PRAGMA quick_check(1)");
  if (!pages)
    note(pages.error());
  else if (*pages != "ok")
    found.faults.push_back(file_.string() + " is damaged (" + *pages + ")" + std::string(kRemedy));

  const Walk walked =
      walk(first_head(genesis_), RoomSeq{INT64_MAX}, [](const JournalEntry&, const JournalHead&) { return true; });
  found.head = walked.head;
  if (walked.stopped) {
    found.first_bad = RoomSeq{walked.head.seq.value + 1};
    note(*walked.stopped);
  } else if (const Result<std::int64_t> entries = database_.integer("SELECT count(*) FROM rows"); !entries) {
    note(entries.error());
  } else if (static_cast<std::uint64_t>(*entries) != found.head.seq.value) {  // some have sequence numbers below 1
    found.faults.push_back(file_.string() + " has entries with sequence numbers below 1" + std::string(kRemedy));
  }
  inspect_beside(files, found);
  return found;
}

void JournalFile::inspect_log(Inspection& found) {
  found.notes = log_.notes;
  if (log_.witnessed > found.head.seq) check_witness({log_.witnessed, {}}, "its log", found);
  found.witnessed = std::max(found.witnessed, log_.witnessed);
  for (const std::string& foreign : log_.foreign)
    found.faults.push_back(foreign +
                           "; put the files of the same moment together again, or salvage it into a new journal");
  if (!needs_log_) return;
  const std::string unknown_count = "how many entries are missing after event " + std::to_string(found.head.seq.value) +
                                    " cannot be told" + std::string(kRemedy);
  for (const std::string& fault : log_.faults) found.faults.push_back(fault + std::string(kRemedy));
  if (!log_.faults.empty()) found.faults.push_back(file_.string() + ": " + unknown_count);
  if (log_.doubtful)
    found.faults.push_back(
        file_.string() + ": a write to one file of its log was cut short, and the other is damaged: " + unknown_count);
  if (log_.generation < generation_ && log_.faults.empty())
    found.faults.push_back(file_.string() + " was not closed, and its log " +
                           (log_.generation == 0 ? "is missing" : "is an older copy") + ": " + unknown_count);
}

void JournalFile::inspect_beside(bool files, Inspection& found) {
  const auto note = [&](const Error& error) { found.faults.push_back(error.message); };
  inspect_log(found);
  inspect_signatures(found);
  if (!erased_.empty())
    found.notes.push_back("text was erased from " + std::to_string(erased_.size()) +
                          " entries; the chain still covers their original hash");
  if (const auto bytes = find_register(kFooterRegister); !bytes) {
    note(bytes.error());
  } else if (*bytes) {
    const std::optional<Footer> footer = decode_footer(**bytes);
    if (!footer) {
      found.faults.push_back(damaged("its footer").value().message);
    } else {
      found.closed_cleanly = footer->clean;
      check_witness(footer->head, "its footer", found);
      if (footer->clean && footer->head.seq < found.head.seq)
        found.faults.push_back(file_.string() + " continues after its footer" + std::string(kRemedy));
    }
  }

  if (const auto all = checkpoints(); !all) {
    note(all.error());
  } else {
    for (const Checkpoint& checkpoint : *all) {
      const fs::path file = checkpoint_file(file_, checkpoint.at);
      check_witness(checkpoint.at, "the checkpoint at event " + std::to_string(checkpoint.at.seq.value), found);
      if (!files) continue;
      const auto read = read_in_pieces(*disk_, file, [](std::string_view) { return Result<void>{}; });
      if (!read)
        note(read.error());
      else if (read->size != checkpoint.size || read->digest != checkpoint.digest)
        found.faults.push_back(file.string() + " is not what was written; the checkpoint before it has to be used");
    }
  }

  // A checkpoint is written only of durable entries, so its name alone vouches for them.
  if (const auto names = disk_->list(folder_of(file_)); !names) {
    note(names.error());
  } else {
    for (const std::string& name : *names)
      if (const auto at = parse_checkpoint_file(file_, name)) check_witness(*at, "the file " + name, found);
  }

  if (const auto size = disk_->size(failed_of(file_)); !size) {
    note(size.error());
  } else if (*size) {
    const auto why = disk_->read(failed_of(file_), 0, 4096);
    found.faults.push_back(why && !why->empty() ? *why
                                                : file_.string() + " failed to be written" + std::string(kRemedy));
  }
  if (const auto all = people(); !all) note(all.error());
  if (const auto names = registers(); !names) {
    note(names.error());
  } else {
    for (const std::string& name : *names) {
      const auto value = find_register(name);
      if (!value)
        note(value.error());
      else if (!*value)  // its name reads the same and is of another type
        note(damaged("the name of its register " + name).value());
    }
  }
}

Result<void> JournalFile::add_entries(std::span<const JournalEntry> entries, JournalHead& head) {
  if (!insert_) {
    auto prepared = database_.prepare(kInsertEntry);
    if (!prepared) return tl::unexpected(prepared.error());
    insert_ = std::move(*prepared);
  }
  for (const JournalEntry& entry : entries) {
    OSTEON_CHECK(entry.seq.value == head.seq.value + 1);
    head = next_in_chain(head, entry);
    Result<void> put = insert_->integer(0, static_cast<std::int64_t>(entry.seq.value))
                           .integer(1, entry.at_ns)
                           .blob(2, entry.bytes)
                           .blob(3, as_text(head.chain))
                           .run();
    if (!put) return put;
  }
  return {};
}

// SQLite's log may contain what a process that died had committed and only partly copied into the file. Nothing is
// appended to that log: a torn write would spoil its end and leave the file half copied.
Result<void> JournalFile::keep_log() {
  JournalHead head = stored_head_;
  return database_.run("ROLLBACK")
      .and_then([&] { return database_.carry_log(); })
      .and_then([&] { return database_.begin(); })
      .and_then([&] { return upgrade(); })
      .and_then([&] { return add_entries(std::exchange(log_.entries, {}), head); })
      .and_then([&] {
        const auto signature = std::exchange(log_.signature, std::nullopt);
        return signature ? add_signed_entries(*signature) : Result<void>{};
      })
      // No log is needed until the next generation begins.
      .and_then([&] {
        return set_register(kFooterRegister, encode_footer({head, true}));
      })
      .and_then([&] { return make_id(); })
      .and_then([&] { return database_.commit(); })
      .and_then([&] { return database_.carry_log(); })
      .and_then([&] { return database_.begin(); });
}

Result<void> JournalFile::upgrade() {
  if (version_ == kJournalVersion) return {};
  return database_.run(kSignatureTable + ("PRAGMA user_version=" + std::to_string(kJournalVersion))).map([&] {
    version_ = kJournalVersion;
  });
}

Result<void> JournalFile::set_register(std::string_view name, std::string_view value) {
  return add_register(
      {std::string(name), std::string(value), make_seal(seal_of(name, value), first_head(genesis_).chain, key_)});
}

Result<void> JournalFile::add_register(const SealedRegister& copied) {
  auto statement = database_.prepare("INSERT OR REPLACE INTO registers(name, value, seal) VALUES(?, ?, ?)");
  if (!statement) return tl::unexpected(statement.error());
  return statement->text(0, copied.name).blob(1, copied.value).blob(2, copied.seal).run();
}

Result<void> JournalFile::note_generation(const LogStart& start) {
  return set_register(kGenerationRegister, encode_number(start.generation)).and_then([&] {
    return set_register(kFooterRegister, encode_footer({start.base, false}));
  });
}

Result<void> JournalFile::add_checkpoint(const Checkpoint& checkpoint) {
  auto statement =
      database_.prepare("INSERT INTO checkpoints(place, chain, meta, size, digest, seal) VALUES(?, ?, ?, ?, ?, ?)");
  if (!statement) return tl::unexpected(statement.error());
  const std::string seal =
      checkpoint.seal.empty() ? make_seal(seal_of(checkpoint), first_head(genesis_).chain, key_) : checkpoint.seal;
  return statement->integer(0, static_cast<std::int64_t>(checkpoint.at.seq.value))
      .blob(1, as_text(checkpoint.at.chain))
      .blob(2, checkpoint.meta)
      .integer(3, static_cast<std::int64_t>(checkpoint.size))
      .blob(4, as_text(checkpoint.digest))
      .blob(5, seal)
      .run();
}

Result<void> JournalFile::add_person(const Person& person) {
  auto statement =
      database_.prepare("INSERT OR REPLACE INTO people(pseudonym, label, joined_day, seal) VALUES(?, ?, ?, ?)");
  if (!statement) return tl::unexpected(statement.error());
  const std::string seal = make_seal(seal_of(person), first_head(genesis_).chain, key_);
  return statement->text(0, person.pseudonym).text(1, person.label).integer(2, person.joined_day).blob(3, seal).run();
}

}  // namespace osteon
