// Seeded trials of a journal on a failing disk. Unit tests run a few, benchmarks many.
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

// The chain of hashes, computed in another way than in the journal.
[[nodiscard]] JournalHead plain_head(const std::string& genesis, const std::vector<JournalEntry>& entries);

// Writes everything to a journal that can be written, and remembers what was promised.
class JournalWriter {
 public:
  JournalWriter(std::uint64_t seed, MemoryDisk& disk, bool durable = true, std::string genesis = "a genesis");

  // Makes the journal, or opens it. False: the disk failed. Wrong behaviour of the journal is noted in faults().
  bool open();
  // Does one operation after the other until `count` are done or the disk fails (false).
  bool work(int count);
  void drop() { journal_.reset(); }  // as if the process had been killed
  // Compares the journal with what was promised, and continues from its present state.
  void check();
  // After a failed write the journal must accept nothing more, even if the disk works again.
  void check_failed();
  // Salvages into a new journal, and continues with that one.
  void recover();

  [[nodiscard]] Journal& journal() { return *journal_; }
  [[nodiscard]] bool is_open() const { return journal_.has_value(); }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::vector<JournalEntry>& acknowledged() const { return acknowledged_; }
  [[nodiscard]] const std::vector<JournalEntry>& asked() const { return asked_; }  // by an append that failed
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
  std::vector<JournalEntry> acknowledged_, asked_;  // asked: the batch during which the disk failed
  std::uint64_t epoch_ = 0;
  std::map<std::string, Person> people_;
  std::optional<std::string> person_asked_;  // may be there or not
  std::map<std::uint64_t, std::string> checkpoints_;
  std::uint64_t lost_ = 0, kept_unasked_ = 0;
  int recoveries_ = 0;
  std::vector<std::string> faults_;
};

struct Tally {
  std::uint64_t trials = 0;
  std::uint64_t acknowledged = 0;  // entries
  std::uint64_t recovered = 0;     // entries found again, including unacknowledged ones
  std::uint64_t kept_unasked = 0;
  std::uint64_t lost = 0;           // acknowledged entries that were gone
  std::uint64_t failed = 0;         // trials in which the disk did fail
  std::uint64_t closed = 0;         // journals that said at opening why they accept no more entries
  std::uint64_t bad_trials = 0;     // with lost entries or any other fault
  std::vector<std::string> faults;  // the first ones, with their seeds
};

// The power fails at a random write or sync, up to three times. Bytes that were not synced are lost, torn, spoiled or
// kept.
[[nodiscard]] Tally power_loss_trials(std::uint64_t first_seed, std::uint64_t count, bool durable = true);
// The n-th write or sync fails, for each n of the first `count`: once or from then on, with a full or a failing disk.
// Then the process ends, in half of the trials with the power, and the room continues from what is there.
[[nodiscard]] Tally failing_disk_trials(std::uint64_t first_seed, std::uint64_t count, int error);

// A sync fails, and no note about it can be written. The next process finds bytes that look written, and the power
// fails while it opens the journal.
[[nodiscard]] Tally forgotten_sync_trials(std::uint64_t first_seed, std::uint64_t count);

}  // namespace osteon::test
