// The room's journal: log entries in one order. A chain of hashes binds each entry to all entries before it. Each entry
// is durable before append() returns. The room's recording, replay, undo and evidence are all read from the journal.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/journal/chain.hpp"
#include "server/journal/journal_parts.hpp"

namespace osteon {

// A checkpoint that is being written in parts, on any thread. The journal itself is not touched before
// Journal::add_checkpoint. A dropped checkpoint leaves nothing.
class CheckpointFile {
 public:
  [[nodiscard]] Result<void> write(std::string_view piece) { return file_.write(piece); }
  [[nodiscard]] Result<void> sync() { return file_.sync(); }  // now and then, so that finish() takes less long
  // Syncs the file and gives it its name. This takes long.
  [[nodiscard]] Result<void> finish();

 private:
  friend class Journal;
  CheckpointFile(Checkpoint about, DurableFile file) : about_(std::move(about)), file_(std::move(file)) {}
  Checkpoint about_;
  DurableFile file_;
  bool finished_ = false;
};

// Consecutive log entries of a journal that is read in parts.
struct JournalSlice {
  std::vector<JournalEntry> entries;
  JournalHead head;              // of the last of them
  std::optional<Error> stopped;  // why the entry after it does not fit
};

// A database, NAME, with checkpoints beside it. While it is open it also has its log, NAME-log and NAME-mirror, which
// hold the newest entries, and SQLite's log, NAME-wal. Not synchronised: one thread at a time, the room's journal
// thread. A journal that accepts no more entries (closed_because) can still be read, backed up and salvaged.
class Journal {
 public:
  // Error exists: a journal, or a file that belonged to one, is there.
  [[nodiscard]] static Result<Journal> create(const std::filesystem::path& file, std::string_view genesis,
                                              const JournalOptions& options = {});
  // Continues where the last process stopped, however that ended, and checks every entry. Errors: not_found; exists (in
  // use by another process); unsupported (an older version: migrate_journal; or a newer one); invalid_input (damaged so
  // that no entry can be read). If entries are damaged, or the journal is behind a witness, it opens but accepts no
  // entries.
  [[nodiscard]] static Result<Journal> open(const std::filesystem::path& file, const JournalOptions& options = {});
  // Opens for reading only: it writes nothing to the file or beside it, and others may read the file too. Adding
  // entries fails. Errors: those of open(). If entries are damaged, closed_because() says so.
  [[nodiscard]] static Result<Journal> open_to_read(const std::filesystem::path& file, Disk* disk = nullptr);
  Journal(Journal&&) noexcept;
  Journal& operator=(Journal&&) noexcept;
  ~Journal();  // without close(): as if the process had been killed

  // Why it accepts no more entries, ever: a failed write, damage, or a witness that knows more. Null: it accepts
  // entries.
  [[nodiscard]] const Error* closed_because() const;
  // Makes it accept no more entries, for a reason of the owner's.
  void close_to_entries(Error reason);

  // Appends all entries. They are durable when it returns; after an error, none of them was ever reported. Sequence
  // numbers must continue from head(). Error invalid_input: an entry above most_entry_bytes, and nothing happens. After
  // any other error the journal accepts no more entries.
  [[nodiscard]] Result<void> append(std::span<const JournalEntry> entries);
  [[nodiscard]] const JournalHead& head() const;
  [[nodiscard]] const std::string& genesis() const;
  // Reads entries from this sequence number up to the head and checks them against the chain again, until `take`
  // returns false. Error: the sentence about the first entry that does not fit.
  [[nodiscard]] Result<void> read(RoomSeq from, const std::function<bool(const JournalEntry&)>& take);

  // The stored head at a sequence number, not beyond head(). Error invalid_input: the entry is missing.
  [[nodiscard]] Result<JournalHead> head_at(RoomSeq seq);
  // The next entries after `after` up to `last`, each checked against the chain. It returns at most `most_entries` of
  // them, and little more than 1 MiB.
  [[nodiscard]] JournalSlice read_slice(const JournalHead& after, RoomSeq last, std::size_t most_entries);

  // Checks a head that was acknowledged as durable, for example a client's last acknowledged entry. Errors:
  // - unavailable: the journal is behind it and from now on accepts no more entries, unless it was salvaged with losses
  //   (see recovered_to). Or it already accepts no entries, and its file does not contain what the witness knows.
  // - invalid_input: the witness knows another history.
  [[nodiscard]] Result<void> check_witness(const JournalHead& witness);
  // The last entry that was salvaged from a damaged journal. What a witness knows beyond it is lost for good.
  [[nodiscard]] std::optional<RoomSeq> recovered_to() const;

  // Begins a checkpoint of the room at `at`, not beyond head(). `seal`: of the checkpoint that this one copies. Errors:
  // exists (there is one at that sequence number), invalid_input (another history).
  [[nodiscard]] Result<CheckpointFile> begin_checkpoint(const JournalHead& at, std::string_view meta,
                                                        std::string_view seal = {});
  // Adds a finished file. Only the newest two checkpoints stay.
  [[nodiscard]] Result<void> add_checkpoint(CheckpointFile file);
  [[nodiscard]] Result<std::vector<Checkpoint>> checkpoints();  // newest first
  // Its bytes, checked against its digest.
  [[nodiscard]] Result<std::string> read_checkpoint(const Checkpoint& checkpoint);

  // Small values by name, each durable when it is set. Setting several together takes only a few syncs for all.
  using Registers = std::vector<std::pair<std::string, std::string>>;
  [[nodiscard]] Result<void> set_register(std::string_view name, std::string_view value);
  [[nodiscard]] Result<void> set_beside(const Registers& registers, const std::vector<Person>& people);
  [[nodiscard]] Result<std::optional<std::string>> find_register(std::string_view name);
  // Counts how often the room was opened. A number never repeats.
  [[nodiscard]] Result<std::uint64_t> next_server_epoch();

  // The names of people can be erased. Then the journal's files contain no byte of their labels. Copies made before
  // still have them.
  [[nodiscard]] Result<void> set_person(const Person& person);
  [[nodiscard]] Result<std::vector<Person>> people();
  [[nodiscard]] Result<std::size_t> erase_person(std::string_view pseudonym);
  [[nodiscard]] Result<std::size_t> erase_people_before(std::int32_t day);  // those who joined before it
  [[nodiscard]] Result<std::size_t> erase_people_if(const std::function<bool(const Person&)>& whom);

  // Replaces each entry for which `without` returns something. `without` is asked about all entries, in their order.
  // The chain, its signatures and the witnesses stay valid. The journal's files contain no byte of the replaced
  // content. Error denied: the journal is signed, and there is no key to sign the change. Returns the number of
  // replaced entries. Takes as long as reading and writing them.
  [[nodiscard]] Result<std::size_t> erase_entries(
      const std::function<std::optional<std::string>(const JournalEntry&)>& without);

  // Copies the entries of the log into the database if there are some hundred. It takes a few syncs, so call it when
  // the room is idle. After an error the journal accepts no more entries.
  [[nodiscard]] Result<void> tidy();
  // Findings from when it was opened, one sentence each. Examples: one file of its log lacked what the other had; a
  // write is incomplete because its process was killed; its key does not vouch for some entries.
  [[nodiscard]] const std::vector<std::string>& notes() const;
  // Whether one of JournalOptions::keys signed a register that exists. Without keys: true for every register that
  // exists.
  [[nodiscard]] Result<bool> is_vouched_for(std::string_view name);
  [[nodiscard]] bool is_signed() const;                                   // whether it signs what it writes from now on
  [[nodiscard]] bool is_vouched_for(const Checkpoint& checkpoint) const;  // one of checkpoints()
  // Vouches for the head in a footer. Then the log is no longer needed and is removed. Does nothing to a journal that
  // accepts no entries. The journal must not be used afterwards.
  [[nodiscard]] Result<void> close();

 private:
  friend struct JournalInside;  // for code that checks and copies a journal in use
  struct State;
  explicit Journal(std::unique_ptr<State> state);
  [[nodiscard]] static Result<Journal> open_locked(const std::filesystem::path& file, const JournalOptions& options,
                                                   std::unique_ptr<DiskLock> lock);
  [[nodiscard]] Result<void> write(const std::function<Result<void>()>& work);
  // Does `work` in the transaction and commits it: durable when it returns. It is slower than appending entries.
  [[nodiscard]] Result<void> write_through(const std::function<Result<void>()>& work);
  [[nodiscard]] Result<void> carry();  // copies the log into the database
  [[nodiscard]] Result<void> check_named();
  [[nodiscard]] Result<void> begin_log();
  // Finds the first entry from which on its key vouches for the entries. Error unavailable: unsigned entries follow
  // signed ones.
  [[nodiscard]] Result<void> begin_signing();
  [[nodiscard]] Result<void> note_keys();
  [[nodiscard]] Result<void> keep_signature();  // of the newest entries, in the database
  void close_for_good(Error reason);            // with a note beside the file for the next process
  [[nodiscard]] Result<std::size_t> keep_people(const std::function<bool(const Person&)>& kept);
  std::unique_ptr<State> state_;
};

}  // namespace osteon
