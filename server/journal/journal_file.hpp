// A journal's tables, as this and every older version of them is read: for the journal itself and for what checks,
// copies and recovers one. Reading writes nothing.
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
[[nodiscard]] std::filesystem::path failed_of(const std::filesystem::path& journal);  // says why it takes no more entries
// Its name is a witness: of the place and the chain there.
[[nodiscard]] std::filesystem::path checkpoint_file(const std::filesystem::path& journal, const JournalHead& at);
[[nodiscard]] std::optional<JournalHead> parse_checkpoint_file(const std::filesystem::path& journal,
                                                               std::string_view name);
// Whether a name in the journal's folder is of something that is still being written: the journal, its log, a
// checkpoint.
[[nodiscard]] bool is_partial_of(const std::filesystem::path& journal, std::string_view name);
// Whether it is the journal itself or anything that was made beside it, also by earlier versions.
[[nodiscard]] bool belongs_to(const std::filesystem::path& journal, std::string_view name);

// Tells a file that cannot be a journal before anything is made beside it: one of another program, a folder, one that
// is cut short. What SQLite has to judge, a first page that the log may still have, is well. Errors: not_found;
// invalid_input; those of reading it.
[[nodiscard]] Result<void> check_is_journal(const std::filesystem::path& file, Disk& disk);

// What a file says of itself.
struct Inspection {
  JournalHead head;                  // of the last entry that the chain confirms
  std::vector<std::string> faults;   // one sentence each; none: sound
  std::optional<RoomSeq> first_bad;  // entry
  bool closed_cleanly = false;
  RoomSeq witnessed;               // the furthest place that its log, a footer or a checkpoint vouches for
  std::vector<std::string> notes;  // of its log: what one file lacks and the other has, a write that is not whole
};

// A register as it is stored.
struct SealedRegister {
  std::string name, value, seal;
};

// An entry of which something was erased.
struct ErasedEntry {
  Digest chain;  // at the entry, as it was written
  Digest bytes;  // of what stands in its place
};
using ErasedEntries = std::map<std::uint64_t, ErasedEntry>;  // by place
[[nodiscard]] std::string encode_erased(const ErasedEntries& entries);
[[nodiscard]] std::optional<ErasedEntries> decode_erased(std::string_view bytes);

struct Walk {
  JournalHead head;              // of the last entry that fitted
  std::optional<Error> stopped;  // why the next one does not
};

class JournalFile {
 public:
  // Makes the tables in a file of that name. Nothing else may be there.
  [[nodiscard]] static Result<void> make(const std::filesystem::path& file, std::string_view genesis, Disk& disk,
                                         const DatabaseOptions& options);
  // Any version that this program reads. The entries of its log are taken into a transaction, which stays open. Error
  // invalid_input: no journal, or damaged beyond reading.
  [[nodiscard]] static Result<JournalFile> open(const std::filesystem::path& file, Disk& disk,
                                                const DatabaseOptions& options);
  // Only to be read. Nothing is written beside it: what is not in its file yet is put together in a copy elsewhere.
  // Nobody may have it open for writing. Errors as of open().
  [[nodiscard]] static Result<JournalFile> open_to_read(const std::filesystem::path& file, Disk& disk);

  // One that may be in use, as far as its log has been carried into the file: only to look for single things in it,
  // since it may be written to at the same time. What it began as is always there, and held against its seal. Errors as
  // of open().
  [[nodiscard]] static Result<JournalFile> peek(const std::filesystem::path& file, Disk& disk);

  [[nodiscard]] int version() const { return version_; }
  [[nodiscard]] const std::string& genesis() const { return genesis_; }
  [[nodiscard]] Database& database() { return database_; }
  // What its log names as its journal: a hash of its genesis and, since version 3, of random bytes of its own. So a log
  // of a room that began alike is not taken for its own.
  [[nodiscard]] Digest identity() const;
  // For one that has no random bytes yet. Within a transaction.
  [[nodiscard]] Result<void> make_id();
  // The newest generation of its log that is known; 0: it never had a log.
  [[nodiscard]] std::uint64_t generation() const { return std::max(generation_, log_.generation); }

  // Rows of which something was erased, as a register of the journal says. The chain goes on over them.
  [[nodiscard]] const ErasedEntries& erased() const { return erased_; }
  // Of the journal that this is a growing copy of.
  void take_erased(const ErasedEntries& entries) { erased_ = entries; }

  // Rows after `before` up to `last`, each held against the chain, as long as `take` returns true.
  [[nodiscard]] Walk walk(const JournalHead& before, RoomSeq last,
                          const std::function<bool(const JournalEntry&, const JournalHead&)>& take);
  [[nodiscard]] Result<std::optional<Digest>> chain_at(RoomSeq place);  // as stored
  [[nodiscard]] Result<std::vector<Checkpoint>> checkpoints();          // newest first
  [[nodiscard]] Result<std::vector<Person>> people(std::vector<std::optional<PublicKey>>* signers = nullptr);
  [[nodiscard]] Result<std::vector<std::string>> registers();  // their names, the journal's own not
  [[nodiscard]] Result<std::optional<std::string>> find_register(std::string_view name);
  [[nodiscard]] Result<std::optional<SealedRegister>> find_sealed(std::string_view name);
  // Who signed an entry that was read from here. None: nobody.
  [[nodiscard]] std::optional<PublicKey> signer_of(const SealedRegister& found) const;
  [[nodiscard]] std::optional<PublicKey> signer_of(const Checkpoint& found) const;
  // In order of their places, that of its log last. inspect() holds them against their keys and against the entries.
  [[nodiscard]] Result<std::vector<SignedRange>> signed_range();
  // The whole file: its pages, its chain, its witnesses. `files`: the checkpoints' bytes too.
  [[nodiscard]] Inspection inspect(bool files);
  // All but pages and entries, of which `found` has the head: what vouches for them, and what is kept beside them.
  void inspect_beside(bool files, Inspection& found);

  // Commits the entries of the log, so that the log is needed no more. Of one that was opened to be written to.
  [[nodiscard]] Result<void> keep_log();

  // Entries that are written from now on are signed with it. Null: with none. It must outlive this.
  void sign_with(const SigningKey* key) { key_ = key; }

  // Within a transaction. Rows go on from `head`, which goes on with them.
  [[nodiscard]] Result<void> add_entries(std::span<const JournalEntry> entries, JournalHead& head);
  [[nodiscard]] Result<void> set_register(std::string_view name, std::string_view value);
  [[nodiscard]] Result<void> add_register(const SealedRegister& copied);
  [[nodiscard]] Result<void> add_signed_entries(const SignedRange& entries);
  [[nodiscard]] Result<void> note_generation(const LogStart& start);  // which ends what a footer said
  [[nodiscard]] Result<void> add_checkpoint(const Checkpoint& checkpoint);
  [[nodiscard]] Result<void> add_person(const Person& person);
  // Puts these bytes in place of those that the entries have.
  [[nodiscard]] Result<void> erase(std::span<const JournalEntry> instead);

 private:
  JournalFile(std::filesystem::path file, Disk& disk, Database database)
      : file_(std::move(file)), disk_(&disk), database_(std::move(database)) {}
  // `database` may be a copy of `file`, or the file as it lies there (`peek`).
  [[nodiscard]] static Result<JournalFile> of_database(const std::filesystem::path& file, Disk& disk, Database database,
                                                       bool peek);
  [[nodiscard]] Result<void> read_version();
  [[nodiscard]] Result<void> check_tables(bool peek);
  [[nodiscard]] Result<JournalHead> stored_head();
  // Inserts the entries that its log has beyond its last one.
  [[nodiscard]] Result<void> take_log();
  [[nodiscard]] Result<void> read_erased();
  // As next_head(), and of an erased entry what its chain was.
  [[nodiscard]] JournalHead next_in_chain(const JournalHead& before, const JournalEntry& entry) const;
  // To the tables of the current version, within a transaction.
  [[nodiscard]] Result<void> upgrade();
  void inspect_signatures(Inspection& found);
  void inspect_log(Inspection& found);
  [[nodiscard]] tl::unexpected<Error> damaged(const std::string& what) const;
  void check_witness(const JournalHead& witness, const std::string& what, Inspection& found);

  std::filesystem::path file_;
  Disk* disk_;
  std::unique_ptr<ScratchFolder> scratch_;  // where the database is a copy; outlives it
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

// A head that is kept as a register, with a mark.
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
