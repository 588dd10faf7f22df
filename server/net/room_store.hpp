// Keeps a room in a journal: writes what it decides, makes it again from that, and looks after it while it is in use.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/link/random_bytes.hpp"
#include "server/journal/journal.hpp"
#include "server/journal/maintenance.hpp"
#include "server/net/journal_entries.hpp"
#include "server/net/room_files.hpp"
#include "server/room/room.hpp"

namespace osteon {

struct PersistedRoom;

// A mutex that is given in the order in which it was asked for: so that maintenance, which takes it again and again,
// lets a commit through after every slice, and is let through itself between commits.
class InTurn {
 public:
  void lock();
  void unlock();

 private:
  std::mutex mutex_;
  std::condition_variable next_;
  std::uint64_t asked_ = 0, served_ = 0;
};

// The bone when so many entries had been applied to it: Room::room_seq() and Room::field_hash().
struct BoneAt {
  RoomSeq place;
  Digest field_hash{};
};

// Whether it is time for the next checkpoint. To evaluate a cut again takes a tenth of a millisecond, with a large tool
// a whole one or two: the next opening has a few seconds of that at most. And so long is waited that a bone that is cut
// fast is not written all the time: every checkpoint has all its leaves.
struct CheckpointPolicy {
  std::uint64_t changes = 2000;
  std::chrono::nanoseconds apart = std::chrono::seconds(60);
  [[nodiscard]] bool is_due(std::uint64_t changes_since, std::chrono::nanoseconds since) const {
    return changes_since >= changes && since >= apart;
  }
};

// What a live verify found.
struct RoomReport {
  JournalHead head;                  // of the last entry that the chain confirms: as many entries
  std::optional<RoomSeq> first_bad;  // entry
  std::size_t checkpoints = 0;       // whose bytes and fields were confirmed
  BoneAt replayed;                   // made again from the entries alone; place 0: nobody asked for it
  std::vector<std::string> faults;   // one sentence each
  [[nodiscard]] bool sound() const { return faults.empty(); }
};

// When a reopened room's time goes on. Nobody knows how long it was away, and its hands worked on: for two seconds
// where they heard nothing, up to the most cuts that they leave unconfirmed (3.6 s) where they heard something else.
// Their cuts come when it is back, and the time that these took must have passed.
inline constexpr std::chrono::nanoseconds kTimeAway = std::chrono::seconds(4);
[[nodiscard]] std::chrono::nanoseconds reopened_time(const Room& room);

// Any thread. What takes long holds the journal for a slice of entries at a time, between which entries are written. After
// close() every function returns the error unavailable.
class RoomStore {
 public:
  struct Options {
    std::string name = "room";  // of a new one
    CutLimits limits;
    std::shared_ptr<ToolBox> tools;  // that a new one begins with; null: the built-in ones
    JournalOptions journal;
    int retention_days = 0;               // who joined more days ago is forgotten; 0: nobody ever
    std::function<std::int32_t()> today;  // days since 1970-01-01; null: the computer's
    FillRandom random;                    // for the key of its witnesses; null: the system's
  };
  // Goes on with the journal's room, up to the last entry that anyone was told of, or makes a new one where there is no
  // such file. `progress` hears the fraction of the entries replayed. Errors: those of Journal::open; unsupported (of
  // another case, kernel or release); invalid_input (entries that cannot be: then recover). A journal that is closed to
  // entries still gives its room, which takes none.
  [[nodiscard]] static Result<PersistedRoom> open(const std::filesystem::path& file, const Case& bone,
                                                  const Options& options,
                                                  const std::function<void(double)>& progress = {});

  // Returns when the entries are safe on the disk: for a Committer. Places go on from the last one.
  [[nodiscard]] Result<void> write(std::span<const LogEntry> entries);
  [[nodiscard]] JournalHead head() const;  // once closed: the last one
  // Why its journal takes no more entries, for good: damage, a write that failed, a witness that knows more. Null: it
  // takes entries. Never waits.
  [[nodiscard]] const Error* closed_to_entries() const { return closed_to_entries_; }
  // Rises with every opening.
  [[nodiscard]] std::uint64_t server_epoch() const { return server_epoch_; }
  // Rows that were evaluated again when it was opened.
  [[nodiscard]] std::uint64_t evaluated() const { return evaluated_; }
  [[nodiscard]] const RoomGenesis& genesis() const { return genesis_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  // What clients are told is safe, now.
  [[nodiscard]] Witness witness() const;
  // What a client says it was told is safe: see Journal::check_witness. One beyond the journal counts only under its
  // seal, so that no client can close a room by what it makes up. An error is a sentence for the client's person: how
  // many events the room has lost, or that it begins anew, and what to do. Error invalid_input: also without a seal.
  [[nodiscard]] Result<void> check_witness(const Witness& witness);

  // The pseudonym under which entries know this person; the same for the same label, until it is forgotten.
  [[nodiscard]] Result<std::uint32_t> person(const std::string& label);
  [[nodiscard]] Result<std::vector<Person>> people();
  // Forgets who a person is, here and not in copies; what it did stays, under its number. False: nobody has that
  // number.
  [[nodiscard]] Result<bool> forget(std::uint32_t person);
  // Whoever joined too long ago by Options::retention_days, as open() does; for once a day. Gives how many.
  [[nodiscard]] Result<std::size_t> forget_old();
  // All that there is of a person: a line of JSON that says who it is, then one for each event of its, until `take`
  // returns false. Error not_found: no event and no name is of that number.
  [[nodiscard]] Result<void> export_person(std::uint32_t person, const std::function<bool(const std::string&)>& take);

  // Rows from one place to another, both included, or to the head as it is now, each held against the chain, until
  // `take` returns false. `take` may wait: a live room can be replayed beside its cutting. Errors: of the first entry
  // that does not fit.
  [[nodiscard]] Result<void> read(RoomSeq from, RoomSeq to, const std::function<bool(const LogEntry&)>& take);
  // Every entry up to the head as it is now against the chain; the bytes of every checkpoint against their digest, and
  // its fields against their hash; what else vouches for places. `live`, of a place that is kept: the entries are also
  // replayed into a fresh room of this case up to there, which takes as long as all its cuts, and the bones compared.
  // What is damaged is told in the report. Errors: unavailable (`live` is beyond the head), cancelled, unsupported (of
  // another case).
  [[nodiscard]] Result<RoomReport> verify(const Case& bone, const std::optional<BoneAt>& live,
                                          const MaintenanceCalls& calls = {});
  // A copy of the journal as it is now, with its people and checkpoints: there whole or not at all. Gives its head.
  // Errors: exists (something is in `to`), invalid_input (damaged: nothing is copied), cancelled.
  [[nodiscard]] Result<JournalHead> backup(const std::filesystem::path& to, const MaintenanceCalls& calls = {});
  // As branch_journal().
  [[nodiscard]] Result<JournalHead> branch(const std::filesystem::path& to, RoomSeq place, const std::string& name,
                                           const MaintenanceCalls& calls = {});

  // Whether this head is of its history: for branches_of().
  [[nodiscard]] Result<bool> has_head(const JournalHead& head);

  // All leaves of the room as it was at `place`, while entries may have gone on, so that the next opening need not
  // evaluate every cut again: written and synced in pieces, noted in a transaction of its own. Nothing happens where
  // the entries up to there are not kept yet, or a checkpoint goes as far. Error cancelled.
  [[nodiscard]] Result<void> checkpoint(RoomSeq place, std::span<const FieldLeaf> leaves,
                                        const MaintenanceCalls& calls = {});
  // Rows since the newest checkpoint that the next opening would have to evaluate: for CheckpointPolicy.
  [[nodiscard]] std::uint64_t changes_since_checkpoint() const;
  // Carries the journal's log into its file where no entry has come since this was asked the last time: for every few
  // seconds.
  [[nodiscard]] Result<void> tidy_if_idle();
  // Clean; what takes long is given up, and a checkpoint that is being written waited for.
  [[nodiscard]] Result<void> close();

 private:
  RoomStore(std::filesystem::path file, Journal journal, RoomGenesis genesis, double pitch_mm, Disk& disk);
  // Of the newest checkpoint that can be read; nothing where there is none.
  struct Fields {
    RoomSeq place;
    std::vector<FieldLeaf> leaves;
  };
  // Leaves and their hash, of a checkpoint's bytes. Error invalid_input.
  [[nodiscard]] Result<std::vector<FieldLeaf>> fields_of(const Checkpoint& one, std::string_view bytes) const;
  [[nodiscard]] Fields newest_fields();
  [[nodiscard]] Result<Room> replay(const Case& bone, const CutLimits& limits, const Fields& fields,
                                    const std::function<void(double)>& progress);
  // Does something with the journal, in turn. Error unavailable: it is closed.
  template <class Do>
  auto with_journal(const Do& what) -> decltype(what(std::declval<Journal&>())) {
    const std::lock_guard in_turn(turn_);
    if (!journal_) return is_closed();
    auto done = what(*journal_);
    note_closing();
    return done;
  }
  void note_closing();  // [in turn]
  [[nodiscard]] tl::unexpected<Error> is_closed() const;
  // The register is made by the first opening that finds none.
  [[nodiscard]] Result<void> find_witness_key(const Options& options);
  [[nodiscard]] Digest seal_of(const JournalHead& head) const;
  // Rows after `at`, which goes on with them, up to `last`. Error invalid_input: the entry after `at` does not fit the
  // chain.
  [[nodiscard]] Result<void> each_entry(JournalHead& at, RoomSeq last,
                                      const std::function<bool(const JournalEntry&)>& take);
  [[nodiscard]] Result<void> run(JournalCopy& copy, const MaintenanceCalls& calls);
  // What is wrong with a checkpoint's bytes; nothing also where it has been replaced by a newer one meanwhile.
  [[nodiscard]] Result<void> check_bytes(const Checkpoint& one, RoomReport& report);

  std::mutex checkpointing_;  // held while one is written; taken before turn_
  std::atomic<bool> closing_ = false;
  mutable InTurn turn_;
  std::optional<Journal> journal_;           // nothing: closed
  JournalHead last_;                         // its head then
  std::optional<Error> why_closed_to_entries_;  // set once, before the next, which points to it
  std::atomic<const Error*> closed_to_entries_ = nullptr;
  const std::filesystem::path file_;
  const RoomGenesis genesis_;
  const double pitch_mm_;
  Disk& disk_;
  int retention_days_ = 0;
  std::function<std::int32_t()> today_;
  std::string witness_key_;
  std::vector<RoomSeq> changes_;    // since the newest checkpoint
  std::optional<RoomSeq> idle_at_;  // its head when tidy_if_idle() looked
  std::uint64_t server_epoch_ = 0, evaluated_ = 0;
};

struct PersistedRoom {
  Room room;
  std::unique_ptr<RoomStore> store;
  bool made = false;  // there was no journal
};

}  // namespace osteon
