// Who breaks what a server promises about its journal: real servers under load, killed, their files damaged, opened a
// second time, on disks that fail. Held against what clients were told, which is kept outside of the server.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/scenes/random.hpp"

namespace osteon::test {

struct BreakerTally {
  std::uint64_t trials = 0, acknowledged = 0;  // acknowledged: entries, in all trials
  std::uint64_t whole = 0;                     // all acknowledged entries are there, and nothing is called damaged
  std::uint64_t named = 0;                     // what is damaged is said, and no entry more is lost than that
  std::uint64_t refused = 0;                   // nothing of it can be read, or nobody is let in, with a sentence
  std::uint64_t silent = 0;                    // anything else: each is a broken promise
  std::uint64_t without_number = 0;            // of the named: entries are missing, and how many is not said
  std::map<std::string, std::uint64_t> done;   // trials by what was done
  std::vector<std::string> faults;             // of the silent ones, with their seeds
};

// [real processes, on the loopback] The same seed does the same; what moment a kill hits depends on the machine too.
class Breaker {
 public:
  // Makes a case and the journal of another room. `thorough`: every command in every trial, not some of them.
  explicit Breaker(bool thorough);
  ~Breaker();

  // A server that works, is stopped and started, and is killed. Then so many times, on a copy of its files: one damage
  // to one file, or both files of the log gone; commands that read, recovery, and a server on it, to which a client
  // comes back. Of `more` only verify and, where that finds nothing, export are asked.
  void damage(std::uint64_t seed, int damages, int more);
  // All files as they were at one moment before: only a client that comes back knows of more.
  void older_copy(std::uint64_t seed);
  // Each command as the second program on the journal of a server at work, also after one of its files was removed.
  void second_openers(std::uint64_t seed);
  // So often: the disk fails while a server is at work [emulated].
  void write_errors(std::uint64_t seed, int times);
  // A small disk that fills while the server is at work. False: this machine lets nobody mount one.
  [[nodiscard]] bool full_disk(std::uint64_t seed);
  // Commands that read, on a journal that nobody may write to: by its permissions, and on a medium. False: the medium
  // was left out, since this machine lets nobody mount one.
  [[nodiscard]] bool read_only(std::uint64_t seed);

  [[nodiscard]] const BreakerTally& tally() const;

 private:
  struct Parts;
  void write_error(std::uint64_t seed, Random random);
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteon::test
