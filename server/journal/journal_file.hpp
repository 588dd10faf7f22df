// Reads a journal's tables, in this version and every older one. The journal itself uses it, and so does the code that
// checks, copies and salvages journals. Reading writes nothing.
#pragma once
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/journal/bytes.hpp"
#include "server/journal/chain.hpp"
#include "server/journal/database.hpp"
#include "server/journal/disk.hpp"
#include "server/journal/journal_parts.hpp"
#include "server/journal/mirrored_log.hpp"
#include "server/journal/signing.hpp"

namespace osteon {

// Files beside the journal's own, besides log_of() and mirror_of().
[[nodiscard]] std::filesystem::path wal_of(const std::filesystem::path& journal);         // SQLite's write-ahead log
[[nodiscard]] std::filesystem::path owner_file_of(const std::filesystem::path& journal);  // names who made it
// says why it accepts no more entries
[[nodiscard]] std::filesystem::path failed_of(const std::filesystem::path& journal);
// Its name is a witness: it contains the sequence number and the chain there.
[[nodiscard]] std::filesystem::path checkpoint_file(const std::filesystem::path& journal, const JournalHead& at);
[[nodiscard]] std::optional<JournalHead> parse_checkpoint_file(const std::filesystem::path& journal,
                                                               std::string_view name);
// Whether a name in the journal's folder belongs to an unfinished file: the journal, its log or a checkpoint.
[[nodiscard]] bool is_partial_of(const std::filesystem::path& journal, std::string_view name);
// Whether it is the journal itself or any file made beside it, also by earlier versions.
[[nodiscard]] bool belongs_to(const std::filesystem::path& journal, std::string_view name);

// Recognises a file that cannot be a journal, before anything is made beside it: a file of another program, a folder,
// or a truncated file. It accepts what only SQLite can judge: a first page that the log may still hold. Errors:
// not_found; invalid_input; those of reading it.
[[nodiscard]] Result<void> check_is_journal(const std::filesystem::path& file, Disk& disk);

// What was found in a journal's file.
struct Inspection {
  JournalHead head;                  // of the last entry that the chain confirms
  std::vector<std::string> faults;   // one sentence each; none: sound
  std::optional<RoomSeq> first_bad;  // sequence number of the entry
  bool closed_cleanly = false;
  RoomSeq witnessed;               // the furthest entry that its log, a footer or a checkpoint vouches for
  std::vector<std::string> notes;  // of its log: what one file lacks and the other has, an incomplete write
};

// A register as it is stored.
struct SealedRegister {
  std::string name, value, seal;
};

// An entry of which something was erased.
struct ErasedEntry {
  Digest chain;  // at the entry, as it was written
  Digest bytes;  // of what replaces it
};
using ErasedEntries = std::map<std::uint64_t, ErasedEntry>;  // by sequence number
[[nodiscard]] std::string encode_erased(const ErasedEntries& entries);
[[nodiscard]] std::optional<ErasedEntries> decode_erased(std::string_view bytes);

struct Walk {
  JournalHead head;              // of the last entry that fitted
  std::optional<Error> stopped;  // why the next one does not
};

// A journal's file, open for reading or writing. Not synchronised: one thread at a time.
class JournalFile {
 public:
  // Makes the tables in a file of that name. The file must not exist.
  [[nodiscard]] static Result<void> make(const std::filesystem::path& file, std::string_view genesis, Disk& disk,
                                         const DatabaseOptions& options);
  // Opens any version that this program reads. It takes the entries of the log into a transaction, which stays open.
  // Error invalid_input: not a journal, or too damaged to read.
  [[nodiscard]] static Result<JournalFile> open(const std::filesystem::path& file, Disk& disk,
                                                const DatabaseOptions& options);
  // Opens for reading only, and writes nothing beside it. If entries are not in the file yet, it assembles a copy
  // elsewhere. Nobody may have the file open for writing. Errors as of open().
  [[nodiscard]] static Result<JournalFile> open_to_read(const std::filesystem::path& file, Disk& disk);

  // Opens a journal that may be in use, as far as its log has been copied into the file. Use it only to look for single
  // values, because another process may write to the file at the same time. The genesis is always there and is checked
  // against its seal. Errors as of open().
  [[nodiscard]] static Result<JournalFile> peek(const std::filesystem::path& file, Disk& disk);

  [[nodiscard]] int version() const { return version_; }
  [[nodiscard]] const std::string& genesis() const { return genesis_; }
  [[nodiscard]] Database& database() { return database_; }
  // Identifies the journal in its log: a hash of its genesis and, since version 3, of random bytes of its own. So the
  // log of another room with the same beginning is not mistaken for its own.
  [[nodiscard]] Digest identity() const;
  // For a journal that has no random bytes yet. Within a transaction.
  [[nodiscard]] Result<void> make_id();
  // The newest known generation of its log; 0: it never had a log.
  [[nodiscard]] std::uint64_t generation() const { return std::max(generation_, log_.generation); }

  // Entries of which something was erased, as a register of the journal lists them. The chain continues over them.
  [[nodiscard]] const ErasedEntries& erased() const { return erased_; }
  // Of the journal of which this is a growing copy.
  void take_erased(const ErasedEntries& entries) { erased_ = entries; }

  // Walks over the entries after `before` up to `last`, each checked against the chain, while `take` returns true.
  [[nodiscard]] Walk walk(const JournalHead& before, RoomSeq last,
                          const std::function<bool(const JournalEntry&, const JournalHead&)>& take);
  [[nodiscard]] Result<std::optional<Digest>> chain_at(RoomSeq seq);  // as stored
  [[nodiscard]] Result<std::vector<Checkpoint>> checkpoints();        // newest first
  [[nodiscard]] Result<std::vector<Person>> people(std::vector<std::optional<PublicKey>>* signers = nullptr);
  [[nodiscard]] Result<std::vector<std::string>> registers();  // their names, without the journal's own
  [[nodiscard]] Result<std::optional<std::string>> find_register(std::string_view name);
  [[nodiscard]] Result<std::optional<SealedRegister>> find_sealed(std::string_view name);
  // Who signed the seal of a register or checkpoint that was read from here. None: nobody.
  [[nodiscard]] std::optional<PublicKey> signer_of(const SealedRegister& found) const;
  [[nodiscard]] std::optional<PublicKey> signer_of(const Checkpoint& found) const;
  // In the order of their sequence numbers, that of its log last. inspect() checks them against their keys and the log
  // entries.
  [[nodiscard]] Result<std::vector<SignedEntries>> signed_entries();
  // Checks the whole file: its pages, its chain, its witnesses. `files`: the checkpoints' bytes too.
  [[nodiscard]] Inspection inspect(bool files);
  // Checks everything but pages and log entries, whose head `found` has: what vouches for them, and what is stored
  // beside them.
  void inspect_beside(bool files, Inspection& found);

  // Commits the entries of the log, so that the log is no longer needed. For a file that was opened for writing.
  [[nodiscard]] Result<void> keep_log();

  // Signs the seals of registers, checkpoints and people that are written from now on with this key. Null: with none.
  // The key must outlive this object. sign_entries() signs log entries.
  void sign_with(const SigningKey* key) { key_ = key; }

  // Within a transaction. The entries continue from `head`, which is updated.
  [[nodiscard]] Result<void> add_entries(std::span<const JournalEntry> entries, JournalHead& head);
  [[nodiscard]] Result<void> set_register(std::string_view name, std::string_view value);
  [[nodiscard]] Result<void> add_register(const SealedRegister& copied);
  [[nodiscard]] Result<void> add_signed_entries(const SignedEntries& entries);
  [[nodiscard]] Result<void> note_generation(const LogStart& start);  // invalidates the footer
  [[nodiscard]] Result<void> add_checkpoint(const Checkpoint& checkpoint);
  [[nodiscard]] Result<void> add_person(const Person& person);
  // Replaces the bytes of these entries.
  [[nodiscard]] Result<void> erase(std::span<const JournalEntry> instead);

 private:
  JournalFile(std::filesystem::path file, Disk& disk, Database database)
      : file_(std::move(file)), disk_(&disk), database_(std::move(database)) {}
  // `database` may be a copy of `file`, or the file as it is (`peek`).
  [[nodiscard]] static Result<JournalFile> of_database(const std::filesystem::path& file, Disk& disk, Database database,
                                                       bool peek);
  [[nodiscard]] Result<void> read_version();
  [[nodiscard]] Result<void> check_tables(bool peek);
  [[nodiscard]] Result<JournalHead> stored_head();
  // Inserts the entries of the log that the table lacks.
  [[nodiscard]] Result<void> take_log();
  [[nodiscard]] Result<void> read_erased();
  // As next_head(). For an erased entry it is the chain that the original had.
  [[nodiscard]] JournalHead next_in_chain(const JournalHead& before, const JournalEntry& entry) const;
  // Upgrades to the tables of the current version, within a transaction.
  [[nodiscard]] Result<void> upgrade();
  void inspect_signatures(Inspection& found);
  void inspect_log(Inspection& found);
  [[nodiscard]] tl::unexpected<Error> damaged(const std::string& what) const;
  void check_witness(const JournalHead& witness, const std::string& what, Inspection& found);

  std::filesystem::path file_;
  Disk* disk_;
  std::unique_ptr<ScratchFolder> scratch_;  // if the database is a copy; outlives it
  Database database_;
  std::optional<Statement> insert_;  // of an entry
  const SigningKey* key_ = nullptr;
  int version_ = 0;
  std::string genesis_;
  std::string id_;
  std::uint64_t generation_ = 0;
  bool needs_log_ = false;  // it was not closed cleanly since the generation began
  ErasedEntries erased_;
  LogContents log_;
  JournalHead stored_head_;  // of the entries without those of the log
};

inline constexpr std::string_view kGenesisRegister = "genesis", kFooterRegister = "footer",
                                  kEpochRegister = "server_epoch", kRecoveredRegister = "recovered",
                                  kGenerationRegister = "log generation", kIdRegister = "journal id",
                                  kKeysRegister = "signing keys", kErasedRegister = "erased rows";

// A head that is stored as a register, with a flag.
struct Footer {
  JournalHead head;
  bool clean = false;
};
[[nodiscard]] std::string encode_footer(const Footer& footer);
[[nodiscard]] std::optional<Footer> decode_footer(std::string_view bytes);
[[nodiscard]] std::string encode_number(std::uint64_t number);
[[nodiscard]] std::optional<std::uint64_t> decode_number(std::string_view bytes);

inline constexpr int kVersionWithTimes = 2;
// Version 3 has the tables of version 2, and a log of its own beside the file. Version 4 has a table of signatures.
inline constexpr int kJournalVersion = 4;

}  // namespace osteon
