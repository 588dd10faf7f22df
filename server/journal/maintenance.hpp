// What is done to journals as files: checking, backing up, recovering, bringing to today's version. What is read is
// left as it was, byte by byte; what is written is a new journal, there whole or not at all.
#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/journal/journal.hpp"

namespace osteon {

// Rows that one key vouches for, both ends included.
struct SignedRange {
  RoomSeq from, to;
  PublicKey key;
};

struct VerifyReport {
  int version = 0;
  JournalHead head;                  // of the last entry that the chain confirms
  std::optional<RoomSeq> first_bad;  // entry
  RoomSeq witnessed;                 // the furthest place that a footer or checkpoint vouches for
  bool closed_cleanly = false;
  std::vector<std::string> faults;  // one sentence each
  std::vector<std::string> notes;   // of its log: what one file lacks and the other has, a write that is not whole
  std::vector<SignedRange> signed_range = {};  // in order of their ends; they may overlap
  // Checkpoints, registers, people and the footer of a journal that was closed, and who signed each. Not what the
  // journal notes for itself.
  std::vector<std::pair<std::string, std::optional<PublicKey>>> entries = {};
  std::vector<Succession> successions = {};  // that it keeps of its server's keys
  [[nodiscard]] bool sound() const { return faults.empty(); }
};

// What a server vouches for in a report that is sound: with a key, and the keys that it had before and after it.
struct Vouched {
  std::vector<SignedRange> entries;                       // one after the other
  std::vector<SignedRange> by_others;                  // entries that another key signed, and none of this server
  std::vector<std::pair<RoomSeq, RoomSeq>> by_nobody;  // both ends included
  std::size_t entries = 0;                             // of VerifyReport::entries, signed by this server
  std::vector<std::string> other_entries;              // not signed by this server
  [[nodiscard]] bool all() const {
    return (!entries.empty() || entries > 0) && by_others.empty() && by_nobody.empty() && other_entries.empty();
  }
};
[[nodiscard]] Vouched vouched_by(const PublicKey& key, const VerifyReport& report);

// Everything: pages, chain, footer, checkpoints and their files. Of any version. Errors: not_found; exists (in use:
// then the program that uses it has to verify it); invalid_input (nothing of it can be read).
[[nodiscard]] Result<VerifyReport> verify_journal(const std::filesystem::path& file, Disk* disk = nullptr);
// Of one in use, as the disk has it. It takes as long as reading the whole file.
[[nodiscard]] Result<VerifyReport> verify_journal(Journal& journal);

// Of one in use, without its pages, its entries and the bytes of its checkpoints, which are read bit by bit: what vouches
// for places, and what is kept beside the entries. A few milliseconds. One sentence for each fault. From here on entries,
// too, are read from the disk and not from SQLite's memory.
[[nodiscard]] std::vector<std::string> verify_beside(Journal& journal);

// A copy of a journal in use up to its head at begin(), made in slices so that entries can be appended between them. The
// copy has the same genesis, chain, people, registers and checkpoints. Dropped unfinished, it leaves nothing.
class JournalCopy {
 public:
  // Error exists: something is there. `source` must outlive the copy.
  [[nodiscard]] static Result<JournalCopy> begin(Journal& source, const std::filesystem::path& to);
  // Another journal, of another genesis, that begins with the entries up to `last` and their checkpoints; of the registers
  // it has these, and it has no people.
  [[nodiscard]] static Result<JournalCopy> begin_branch(Journal& source, const std::filesystem::path& to, RoomSeq last,
                                                        std::string genesis, std::vector<std::string> registers);
  JournalCopy(JournalCopy&&) noexcept;
  JournalCopy& operator=(JournalCopy&&) = delete;
  ~JournalCopy();

  // Copies some more entries, or a checkpoint. True: all is copied, checked and synced.
  [[nodiscard]] Result<bool> step(std::size_t most_entries = 1000);
  // The two halves of a step: only take() uses the source, only put() waits for the copy to be written.
  [[nodiscard]] Result<void> take(std::size_t most_entries);
  [[nodiscard]] Result<bool> put();
  [[nodiscard]] double fraction() const;          // of the entries
  [[nodiscard]] const JournalHead& head() const;  // of the copy so far

 private:
  friend struct JournalCopying;
  struct State;
  explicit JournalCopy(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// In one go, of a journal that is not in use. `keys` sign the copy's footer and people; what else is signed stays so.
// Error invalid_input: it is not sound.
[[nodiscard]] Result<void> backup_journal(const std::filesystem::path& file, const std::filesystem::path& to,
                                          Disk* disk = nullptr, std::shared_ptr<const SigningKeys> keys = nullptr);

// Into the current version. Errors: exists (it is of that already, or `to` is there); invalid_input (it is not sound).
[[nodiscard]] Result<void> migrate_journal(const std::filesystem::path& file, const std::filesystem::path& to,
                                           Disk* disk = nullptr, std::shared_ptr<const SigningKeys> keys = nullptr);

// Whether a journal has this head in its history, as stored: then whoever names it has continued this one. Of a journal
// that is in use it is looked for in what has been carried from the log into the file. Errors: those of verify_journal;
// exists (in use, and the place is not found).
[[nodiscard]] Result<bool> has_head(const std::filesystem::path& file, const JournalHead& head, Disk* disk = nullptr);

// Removes journals with all that was made beside them, one after the other, once none of them is in use; also what is
// left of one whose removal was cut short. Each is there whole until it is no journal any more. Copies elsewhere stay,
// and whoever can read the disk itself may find what a file was. Errors: exists (in use: nothing is removed), not_found
// (nothing of it is there: nothing is removed).
[[nodiscard]] Result<void> delete_journals(const std::vector<std::filesystem::path>& files, Disk* disk = nullptr);

struct RecoverReport {
  JournalHead head;                 // of the new journal
  RoomSeq witnessed;                // what was vouched for; beyond head: lost
  std::vector<std::string> faults;  // of the old one
  [[nodiscard]] std::uint64_t lost() const { return witnessed > head.place ? witnessed.value - head.place.value : 0; }
};
// Every entry up to the last that the chain confirms, in a new journal that takes entries. `known`: what clients say they
// were told, to count as witnesses. `last`: no entry after it; null: all. `keys` sign that it was recovered: else a
// server with keys takes no entries behind those that it did not sign. Error invalid_input: not even its genesis can be
// read.
[[nodiscard]] Result<RecoverReport> salvage_journal(const std::filesystem::path& file, const std::filesystem::path& to,
                                                    Disk* disk = nullptr, const std::vector<JournalHead>& known = {},
                                                    RoomSeq last = {},
                                                    std::shared_ptr<const SigningKeys> keys = nullptr);

}  // namespace osteon
