// Seeded trials of a journal whose files something has changed after its process was killed: any number of them.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace osteon::test {

enum class DamagedFiles {
  one,            // of the journal's files, any
  only_log_left,  // the mirror is gone, as if there had never been one, and the log is damaged
};

struct DamageTally {
  std::uint64_t trials = 0;
  std::uint64_t acknowledged = 0;    // entries, in all trials
  std::uint64_t whole = 0;           // all acknowledged entries are there, and the journal goes on
  std::uint64_t named = 0;           // opened to be read, with the right number of missing entries, or "cannot be told"
  std::uint64_t refused = 0;         // not opened, with a sentence
  std::uint64_t silent = 0;          // entries are missing or differ, and nothing says so
  std::uint64_t called_damaged = 0;  // though nothing was done to it
  std::map<std::string, std::uint64_t> done;  // trials by what was done
  std::vector<std::string> faults;            // the first few, with their seeds
};

// A journal is written to, its process is killed at a random write or sync, and then one of its files is flipped,
// filled, cut, deleted, exchanged for another or for an older copy of itself. It is opened, verified and recovered.
// Held against what was acknowledged.
[[nodiscard]] DamageTally damage_trials(std::uint64_t first_seed, std::uint64_t count,
                                        DamagedFiles files = DamagedFiles::one);

// Killed, or without power, at the n-th write or sync, for each n of the first `count`, and nothing else: what is then
// called damaged is a false alarm.
[[nodiscard]] DamageTally kill_trials(std::uint64_t first_seed, std::uint64_t count, bool power_fails);

}  // namespace osteon::test
