// Seeded trials of a journal whose files are changed after its process was killed. Any number of trials.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace osteon::test {

enum class DamagedFiles {
  one,            // any one of the journal's files
  only_log_left,  // the mirror is gone, as if it had never existed, and the log is damaged
};

struct DamageTally {
  std::uint64_t trials = 0;
  std::uint64_t acknowledged = 0;  // entries, in all trials
  std::uint64_t whole = 0;         // all acknowledged entries are there, and the journal continues
  // opened for reading, with the right number of missing entries, or "cannot be told"
  std::uint64_t named = 0;
  std::uint64_t refused = 0;                  // not opened, with a sentence
  std::uint64_t silent = 0;                   // entries are missing or differ, without any report
  std::uint64_t called_damaged = 0;           // although nothing was damaged
  std::map<std::string, std::uint64_t> done;  // number of trials by kind of damage
  std::vector<std::string> faults;            // the first ones, with their seeds
};

// A journal is written, and its process is killed at a random write or sync. Then one of its files is flipped, filled,
// cut, deleted, or exchanged for another file or for an older copy of itself. The journal is opened, verified and
// salvaged, and compared with what was acknowledged.
[[nodiscard]] DamageTally damage_trials(std::uint64_t first_seed, std::uint64_t count,
                                        DamagedFiles files = DamagedFiles::one);

// Killed, or without power, at the n-th write or sync, for each n of the first `count`, without any other damage. A
// report of damage is then a false alarm.
[[nodiscard]] DamageTally kill_trials(std::uint64_t first_seed, std::uint64_t count, bool power_fails);

}  // namespace osteon::test
