// Real time: what a periodic thread asks of the machine, and what the machine lacks, in sentences with the remedy.
#pragma once
#include <string>
#include <vector>

namespace osteon {

// What the calling thread got.
struct Realtime {
  bool fifo = false;    // SCHED_FIFO
  bool locked = false;  // memory: no page is ever fetched from disk, and the stack is there already
  bool exact = false;   // timer slack of 1 ns instead of 50 us
  [[nodiscard]] bool all() const noexcept { return fifo && locked && exact; }
};
// For the calling thread: SCHED_FIFO at this priority, mlockall for the whole process, its stack touched 256 KiB deep,
// timer slack 1 ns. Takes what it can get. May take long: before the loop, never in it.
Realtime make_realtime(int priority) noexcept;

// A machine as a periodic thread finds it. Read by look_at_machine(); strings are empty and numbers negative where the
// machine does not tell.
struct MachineFacts {
  int cores = 1;
  bool fifo_works = false, lock_works = false, slack_works = false;  // tried, on a thread that ended again
  long rtprio_limit = -1;                                            // ulimit -r; LONG_MAX: none
  long memlock_limit_kib = -1;                                       // ulimit -l; LONG_MAX: none
  std::vector<std::string> governors;                                // one for each core that has one
  std::string preemption;   // "rt", "full", "voluntary", "none", "dynamic" (set at boot, not told)
  long rt_runtime_us = -1;  // of every second that real-time threads may have; -1 told by the machine: all
  bool rt_runtime_told = false;
  long timer_resolution_ns = -1;
  std::string clock_source;  // "tsc", "kvm-clock", …
  bool virtual_machine = false;
};
[[nodiscard]] MachineFacts look_at_machine(int priority);

enum class Finding { fine, note, lacking };  // a note: it works, but not as well as it could
struct MachineFinding {
  Finding kind = Finding::fine;
  std::string sentence;  // what is so
  std::string remedy;    // how to change it; empty where fine
};
// What these facts mean for a loop at this priority that locks about this much memory. Most important first.
[[nodiscard]] std::vector<MachineFinding> judge(const MachineFacts& facts, int priority, long memory_kib);

}  // namespace osteon
