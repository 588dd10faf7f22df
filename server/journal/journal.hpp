// The room's journal: entries in one order, each bound by a chain of hashes to all before it, and safe on the disk before
// append() returns. The recording, the replay, the undo and the evidence of the room are all read from it.
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

// A checkpoint being written, piece by piece, on any thread: nothing of the journal itself is touched before
// Journal::add_checkpoint. One that is dropped leaves nothing.
class CheckpointFile {
 public:
  [[nodiscard]] Result<void> write(std::string_view piece) { return file_.write(piece); }
  [[nodiscard]] Result<void> sync() { return file_.sync(); }  // now and then, so that finish() takes less long
  // Syncs the file and gives it its name: this is what takes long.
  [[nodiscard]] Result<void> finish();

 private:
  friend class Journal;
  CheckpointFile(Checkpoint about, DurableFile file) : about_(std::move(about)), file_(std::move(file)) {}
  Checkpoint about_;
  DurableFile file_;
  bool finished_ = false;
};

// Rows that follow one another, of a journal that is read bit by bit.
struct JournalSlice {
  std::vector<JournalEntry> entries;
  JournalHead head;              // of the last of them
  std::optional<Error> stopped;  // why the entry after it does not fit
};

// A database, NAME, and checkpoints beside it; while it is open also its log, NAME-log and NAME-mirror, which hold the
// newest entries, and SQLite's own, NAME-wal. Not synchronised: one thread at a time, the room's journal thread. What
// takes entries no more (closed_because) can still be read, backed up and recovered.
class Journal {
 public:
  // Error exists: a journal, or what belonged to one, is there.
  [[nodiscard]] static Result<Journal> create(const std::filesystem::path& file, std::string_view genesis,
                                              JournalOptions options = {});
  // Takes over where the last process left off, however it ended, and confirms every entry. Errors: not_found; exists (in
  // use by another process); unsupported (an older version: migrate_journal; a newer one); invalid_input (damaged so
  // that no entry can be read). Where entries are damaged, or the journal is behind a witness, it opens and is closed to
  // entries.
  [[nodiscard]] static Result<Journal> open(const std::filesystem::path& file, JournalOptions options = {});
  // Only to be read: nothing is written to it or beside it, and others may read it too. What takes entries fails. Errors:
  // those of open(); where entries are damaged, closed_because() says so.
  [[nodiscard]] static Result<Journal> open_to_read(const std::filesystem::path& file, Disk* disk = nullptr);
  Journal(Journal&&) noexcept;
  Journal& operator=(Journal&&) noexcept;
  ~Journal();  // without close(): as if the process had been killed

  // Why it takes no more entries, for good: a write that failed, damage, a witness that knows more. Null: it takes entries.
  [[nodiscard]] const Error* closed_because() const;
  // Closes it to entries, for a reason of the owner's.
  void close_to_entries(Error reason);

  // All of them or, after an error, none that was ever reported: safe on the disk when it returns. Places must go on
  // from head(). Error invalid_input: an entry above most_entry_bytes, and nothing happens; any other closes the journal to
  // entries.
  [[nodiscard]] Result<void> append(std::span<const JournalEntry> entries);
  [[nodiscard]] const JournalHead& head() const;
  [[nodiscard]] const std::string& genesis() const;
  // Rows from this place on up to the head, held against the chain again, until `take` returns false. Error: the
  // sentence of the first that does not fit.
  [[nodiscard]] Result<void> read(RoomSeq from, const std::function<bool(const JournalEntry&)>& take);

  // What the journal says up to a place, not beyond head(): as stored. Error invalid_input: the entry is missing.
  [[nodiscard]] Result<JournalHead> head_at(RoomSeq place);
  // The next entries after `after` up to `last`, each held against the chain: so many at most, and of little more than 1
  // MiB.
  [[nodiscard]] JournalSlice read_slice(const JournalHead& after, RoomSeq last, std::size_t most_entries);

  // What somebody was told was safe, a client's last acknowledged entry, say. Error unavailable: the journal is behind
  // it, and from now on closed to entries for good, unless it was recovered with losses (see recovered_to); or it is
  // closed to entries, and its file does not show what the witness knows. Error invalid_input: the witness knows another
  // history.
  [[nodiscard]] Result<void> check_witness(const JournalHead& witness);
  // Where it was cut off when it was recovered from a damaged one: what a witness knows beyond is lost for good.
  [[nodiscard]] std::optional<RoomSeq> recovered_to() const;

  // The room as it was at `at`, not beyond head(). `seal`: of the checkpoint that this one is a copy of. Errors: exists
  // (there is one of that place), invalid_input (another history).
  [[nodiscard]] Result<CheckpointFile> begin_checkpoint(const JournalHead& at, std::string_view meta,
                                                        std::string_view seal = {});
  // Of a finished file. Only the newest two stay.
  [[nodiscard]] Result<void> add_checkpoint(CheckpointFile file);
  [[nodiscard]] Result<std::vector<Checkpoint>> checkpoints();  // newest first
  // Its bytes, held against its digest.
  [[nodiscard]] Result<std::string> read_checkpoint(const Checkpoint& checkpoint);

  // Small values by name, each safe on the disk when set. It takes a few syncs, for all of them together.
  using Registers = std::vector<std::pair<std::string, std::string>>;
  [[nodiscard]] Result<void> set_register(std::string_view name, std::string_view value);
  [[nodiscard]] Result<void> set_beside(const Registers& registers, const std::vector<Person>& people);
  [[nodiscard]] Result<std::optional<std::string>> find_register(std::string_view name);
  // Counts the openings of the room; never the same again.
  [[nodiscard]] Result<std::uint64_t> next_server_epoch();

  // People can be forgotten: then no byte of their labels is left in the journal's files. Copies made before have them.
  [[nodiscard]] Result<void> set_person(const Person& person);
  [[nodiscard]] Result<std::vector<Person>> people();
  [[nodiscard]] Result<std::size_t> forget_person(std::string_view pseudonym);
  [[nodiscard]] Result<std::size_t> forget_people_before(std::int32_t day);  // who joined before it
  [[nodiscard]] Result<std::size_t> forget_people_if(const std::function<bool(const Person&)>& whom);

  // Puts what `without` returns in place of an entry, where it returns something. Asked for all entries in their order. The
  // chain, its signatures and what witnesses know stay. No byte of what was there before is left in the journal's
  // files. Error denied: it is signed, and there is no key to sign this. Returns how many entries are others now. Takes as
  // long as reading and writing them.
  [[nodiscard]] Result<std::size_t> erase_entries(
      const std::function<std::optional<std::string>(const JournalEntry&)>& without);

  // Carries the entries of the log into the database, if there are some hundred: for when the room is idle, since it takes
  // a few syncs. An error closes the journal to entries.
  [[nodiscard]] Result<void> tidy();
  // What was found when it was opened, a sentence each: what one file of its log lacked and the other had, a write that
  // is not whole, since its process was killed, entries that its key does not vouch for.
  [[nodiscard]] const std::vector<std::string>& notes() const;
  // Whether one of JournalOptions::keys signed a register that is there; without keys, whatever is there.
  [[nodiscard]] Result<bool> is_vouched_for(std::string_view name);
  [[nodiscard]] bool is_signed() const;                                   // whether what is written from now on is
  [[nodiscard]] bool is_vouched_for(const Checkpoint& checkpoint) const;  // one of checkpoints()
  // Vouches for the head in a footer, with which the log is needed no more and goes; of a journal that is closed to
  // entries, nothing. The journal must not be used afterwards.
  [[nodiscard]] Result<void> close();

 private:
  friend struct JournalInside;  // for what checks and copies one while it is in use
  struct State;
  explicit Journal(std::unique_ptr<State> state);
  [[nodiscard]] static Result<Journal> open_locked(const std::filesystem::path& file, const JournalOptions& options,
                                                   std::unique_ptr<DiskLock> lock);
  [[nodiscard]] Result<void> write(const std::function<Result<void>()>& work);
  // Does something in the transaction and commits it: safe on the disk when it returns, but for entries not the fast way.
  [[nodiscard]] Result<void> write_through(const std::function<Result<void>()>& work);
  [[nodiscard]] Result<void> carry();  // the log into the database
  [[nodiscard]] Result<void> check_named();
  [[nodiscard]] Result<void> begin_log();
  // Finds out from which entry on its key vouches for the entries. Error unavailable: entries without a signature follow on
  // signed ones.
  [[nodiscard]] Result<void> begin_signing();
  [[nodiscard]] Result<void> note_keys();
  [[nodiscard]] Result<void> keep_signature();  // of the newest entries, in the database
  void close_for_good(Error reason);            // with a note beside the file for the next process
  [[nodiscard]] Result<std::size_t> keep_people(const std::function<bool(const Person&)>& kept);
  std::unique_ptr<State> state_;
};

}  // namespace osteon
