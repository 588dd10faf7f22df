// Seeded trials of a journal on a disk that fails, any number of them: a few in the unit tests, many in the benches.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"
#include "tests/support/disk/memory_disk.hpp"

namespace osteon::test {

// The chain of hashes, computed by another road than the journal's.
[[nodiscard]] JournalHead plain_head(const std::string& genesis, const std::vector<JournalEntry>& entries);

// Someone who writes to a journal all that can be written, and knows what was promised.
class JournalWriter {
 public:
  JournalWriter(std::uint64_t seed, MemoryDisk& disk, bool durable = true, std::string genesis = "a genesis");

  // Makes the journal, or opens it. False: the disk failed meanwhile. Faults that it must not have are noted.
  bool open();
  // One thing after the other until `count` are done or the disk fails (false).
  bool work(int count);
  void drop() { journal_.reset(); }  // as if the process had been killed
  // Holds the journal against what was promised, and goes on from what is there.
  void check();
  // After a failed write nothing more is taken, even from a disk that is well again.
  void check_failed();
  // Into a new journal, which is gone on with.
  void recover();

  [[nodiscard]] Journal& journal() { return *journal_; }
  [[nodiscard]] bool is_open() const { return journal_.has_value(); }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::vector<JournalEntry>& acknowledged() const { return acknowledged_; }
  [[nodiscard]] const std::vector<JournalEntry>& asked() const { return asked_; }  // of an append that failed
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  [[nodiscard]] std::uint64_t kept_unasked() const {
    return kept_unasked_;
  }  // entries that were not acknowledged, yet are there
  [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }

 private:
  bool append();
  bool write_checkpoint();
  void fault(const std::string& sentence) { faults_.push_back(sentence); }
  std::uint64_t below(std::uint64_t count) { return random_() % count; }

  std::mt19937_64 random_;
  MemoryDisk& disk_;
  JournalOptions options_;
  std::filesystem::path file_ = "/room/journal";
  std::string genesis_;
  std::optional<Journal> journal_;
  bool made_ = false;
  std::vector<JournalEntry> acknowledged_, asked_;  // asked: the batch in whose midst the disk failed
  std::uint64_t epoch_ = 0;
  std::map<std::string, Person> people_;
  std::optional<std::string> person_asked_;  // may be there in either way
  std::map<std::uint64_t, std::string> checkpoints_;
  std::uint64_t lost_ = 0, kept_unasked_ = 0;
  int recoveries_ = 0;
  std::vector<std::string> faults_;
};

struct Tally {
  std::uint64_t trials = 0;
  std::uint64_t acknowledged = 0;  // entries
  std::uint64_t recovered = 0;     // entries found again, those not acknowledged included
  std::uint64_t kept_unasked = 0;
  std::uint64_t lost = 0;           // acknowledged entries that were gone
  std::uint64_t failed = 0;         // trials in which the disk did fail
  std::uint64_t closed = 0;         // openings of a journal that said why it takes no more entries
  std::uint64_t bad_trials = 0;     // with lost entries or anything else that must not be
  std::vector<std::string> faults;  // the first few, with their seeds
};

// The power fails at a random write or sync, up to three times; what was not synced is lost, torn, spoiled or kept.
[[nodiscard]] Tally power_loss_trials(std::uint64_t first_seed, std::uint64_t count, bool durable = true);
// The n-th write or sync fails, for each n of the first `count`: once or from then on, with a full disk or a failing
// one. Then the process goes, in half of the trials the power too, and the room goes on from what is there.
[[nodiscard]] Tally failing_disk_trials(std::uint64_t first_seed, std::uint64_t count, int error);

// A sync fails, and nothing can be noted about it; the next process finds what looks written, and the power fails while
// it opens the journal.
[[nodiscard]] Tally forgotten_sync_trials(std::uint64_t first_seed, std::uint64_t count);

}  // namespace osteon::test
