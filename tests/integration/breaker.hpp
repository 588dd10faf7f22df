// Tries to break what a server promises about its journal. Real servers work under load and are killed. Their files are
// damaged or opened a second time, and their disks fail. The result is compared with what clients received, which is
// recorded outside of the server.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/scenes/random.hpp"

namespace osteon::test {

struct BreakerTally {
  std::uint64_t trials = 0, acknowledged = 0;  // acknowledged: log entries in all trials
  std::uint64_t whole = 0;                     // all acknowledged entries are there, and nothing is called damaged
  std::uint64_t named = 0;                     // the damage is reported, and no more entries are lost than reported
  std::uint64_t refused = 0;                   // nothing can be read, or nobody is admitted; a sentence says so
  std::uint64_t silent = 0;                    // anything else: each is a broken promise
  std::uint64_t without_number = 0;            // of the named: entries are missing without their number
  std::map<std::string, std::uint64_t> done;   // trials by kind of damage
  std::vector<std::string> faults;             // of the silent ones, with their seeds
};

// [real processes, on the loopback] The same seed does the same. The moment that a kill hits also depends on the
// machine.
class Breaker {
 public:
  // Makes a case and the journal of another room. `thorough`: runs every command in every trial, not only some.
  explicit Breaker(bool thorough);
  ~Breaker();

  // Starts a server that works, is stopped and started, and is killed. Then repeats `damages` times, on a copy of its
  // files: damages one file, or removes both files of the log.
  // Then runs the commands that read, salvage, and a server to which a client comes back. A further `more` trials run
  // only verify and, if that finds nothing, export.
  void damage(std::uint64_t seed, int damages, int more);
  // Replaces all files by those of an earlier moment. Only a client that comes back knows of newer entries.
  void older_copy(std::uint64_t seed);
  // Runs each command as the second program on the journal of a running server, also after one of its files was
  // removed.
  void second_openers(std::uint64_t seed);
  // Lets the disk fail `times` times while a server is at work [emulated].
  void write_errors(std::uint64_t seed, int times);
  // Fills a small disk while the server is at work. False: this machine does not allow mounts.
  [[nodiscard]] bool full_disk(std::uint64_t seed);
  // Runs the commands that read on a journal that nobody may write to: by its permissions, and on a read-only medium.
  // False: this machine does not allow mounts, so the medium was left out.
  [[nodiscard]] bool read_only(std::uint64_t seed);

  [[nodiscard]] const BreakerTally& tally() const;

 private:
  struct Parts;
  void write_error(std::uint64_t seed, Random random);
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteon::test
