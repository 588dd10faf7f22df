// Operations on journals as files: verification, backup, salvage, migration to the current version. The source is not
// changed by a single byte. The result is a new journal that exists whole or not at all.
#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/journal/journal.hpp"

namespace osteon {

// Entries that one key vouches for, both ends included.
struct SignedRange {
  RoomSeq from, to;
  PublicKey key;
};

struct VerifyReport {
  int version = 0;
  JournalHead head;                  // of the last entry that the chain confirms
  std::optional<RoomSeq> first_bad;  // sequence number of the entry
  RoomSeq witnessed;                 // the furthest entry that a footer or checkpoint vouches for
  bool closed_cleanly = false;
  std::vector<std::string> faults;             // one sentence each
  std::vector<std::string> notes;              // of its log: what one file lacks and the other has, an incomplete write
  std::vector<SignedRange> signed_range = {};  // in order of their ends; they may overlap
  // Checkpoints, registers, people and the footer of a closed journal, and who signed each of them. What the journal
  // records for itself is not listed.
  std::vector<std::pair<std::string, std::optional<PublicKey>>> seals = {};
  std::vector<Succession> successions = {};  // it stores them about its server's keys
  [[nodiscard]] bool sound() const { return faults.empty(); }
};

// What a server vouches for in a sound report: with one key, and with the keys before and after it.
struct Vouched {
  std::vector<SignedRange> ranges;                     // one after the other
  std::vector<SignedRange> by_others;                  // entries that another key signed and no key of this server
  std::vector<std::pair<RoomSeq, RoomSeq>> by_nobody;  // both ends included
  std::size_t seals = 0;                               // of VerifyReport::seals, signed by this server
  std::vector<std::string> other_seals;                // not signed by this server
  [[nodiscard]] bool all() const {
    return (!ranges.empty() || seals > 0) && by_others.empty() && by_nobody.empty() && other_seals.empty();
  }
};
[[nodiscard]] Vouched vouched_by(const PublicKey& key, const VerifyReport& report);

// Verifies everything, in any version: pages, chain, footer, checkpoints and their files. Errors: not_found; exists (in
// use: then the program that uses it has to verify it); invalid_input (nothing of it can be read).
[[nodiscard]] Result<VerifyReport> verify_journal(const std::filesystem::path& file, Disk* disk = nullptr);
// Verifies a journal in use, as it is on the disk. It takes as long as reading the whole file.
[[nodiscard]] Result<VerifyReport> verify_journal(Journal& journal);

// Verifies what vouches for the entries of a journal in use, and what is stored beside the entries. It omits the pages,
// the entries and the bytes of the checkpoints, which are read in parts. It takes a few milliseconds. Returns one
// sentence for each fault. Afterwards entries, too, are read from the disk and not from SQLite's memory.
[[nodiscard]] std::vector<std::string> verify_beside(Journal& journal);

// A copy of a journal in use, up to its head at begin(). It is made in steps, so that entries can be appended between
// them. The copy has the same genesis, chain, people, registers and checkpoints. An unfinished copy leaves nothing.
class JournalCopy {
 public:
  // Error exists: something is there. `source` must outlive the copy.
  [[nodiscard]] static Result<JournalCopy> begin(Journal& source, const std::filesystem::path& to);
  // Another journal, with another genesis. It begins with the entries up to `last` and their checkpoints. It has only
  // these registers, and no people.
  [[nodiscard]] static Result<JournalCopy> begin_branch(Journal& source, const std::filesystem::path& to, RoomSeq last,
                                                        std::string genesis, std::vector<std::string> registers);
  JournalCopy(JournalCopy&&) noexcept;
  JournalCopy& operator=(JournalCopy&&) = delete;
  ~JournalCopy();

  // Copies more entries, or a checkpoint. True: everything is copied, checked and synced.
  [[nodiscard]] Result<bool> step(std::size_t most_entries = 1000);
  // The two halves of a step: only take() uses the source, and only put() waits for the copy to be written.
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

// Copies a journal that is not in use in one call. `keys` sign the copy's footer and people. Other signatures are
// copied as they are. Error invalid_input: the journal is not sound.
[[nodiscard]] Result<void> backup_journal(const std::filesystem::path& file, const std::filesystem::path& to,
                                          Disk* disk = nullptr, std::shared_ptr<const SigningKeys> keys = nullptr);

// Copies into the current version. Errors: exists (it has that version already, or `to` is there); invalid_input (it is
// not sound).
[[nodiscard]] Result<void> migrate_journal(const std::filesystem::path& file, const std::filesystem::path& to,
                                           Disk* disk = nullptr, std::shared_ptr<const SigningKeys> keys = nullptr);

// Whether a journal has this stored head in its history. Then whoever names the head has continued this journal. In a
// journal in use, only what was copied from the log into the file is searched. Errors: those of verify_journal; exists
// (in use, and the sequence number is not found).
[[nodiscard]] Result<bool> has_head(const std::filesystem::path& file, const JournalHead& head, Disk* disk = nullptr);

// Removes journals with all files that were made beside them, one after the other, once none of them is in use. Also
// removes what an interrupted removal left. Each journal is whole until it stops being a journal. Copies elsewhere
// stay, and whoever can read the disk itself may find the content of a file. Errors: exists (in use: nothing is
// removed), not_found (nothing of it is there: nothing is removed).
[[nodiscard]] Result<void> delete_journals(const std::vector<std::filesystem::path>& files, Disk* disk = nullptr);

struct RecoverReport {
  JournalHead head;                 // of the new journal
  RoomSeq witnessed;                // what was vouched for; entries beyond head are lost
  std::vector<std::string> faults;  // of the old one
  [[nodiscard]] std::uint64_t lost() const { return witnessed > head.seq ? witnessed.value - head.seq.value : 0; }
};
// Copies every entry up to the last that the chain confirms into a new journal that accepts entries. `known`: the heads
// that clients had acknowledged, as further witnesses. `last`: no entry after it; null: all. `keys` sign that the
// journal was salvaged. Without that, a server with keys accepts no entries after those that it did not sign. Error
// invalid_input: not even its genesis can be read.
[[nodiscard]] Result<RecoverReport> salvage_journal(const std::filesystem::path& file, const std::filesystem::path& to,
                                                    Disk* disk = nullptr, const std::vector<JournalHead>& known = {},
                                                    RoomSeq last = {},
                                                    std::shared_ptr<const SigningKeys> keys = nullptr);

}  // namespace osteon
