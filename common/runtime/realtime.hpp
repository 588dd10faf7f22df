// Real time: requests what a periodic thread needs from the machine, and reports what is missing, with the remedy.
#pragma once
#include <string>
#include <vector>

namespace osteon {

// What the calling thread got from the system.
struct Realtime {
  bool fifo = false;    // SCHED_FIFO
  bool locked = false;  // memory: no page is ever fetched from disk, and the stack already exists
  bool exact = false;   // timer slack of 1 ns instead of 50 us
  [[nodiscard]] bool all() const noexcept { return fifo && locked && exact; }
};
// Requests for the calling thread: SCHED_FIFO at this priority, mlockall for the whole process, its stack touched 256
// KiB deep, timer slack 1 ns. Whatever is refused is skipped. It may take long, so call it before the loop, never in
// the loop.
Realtime make_realtime(int priority) noexcept;

// Properties of a machine that matter to a periodic thread. Read by look_at_machine(). Strings are empty and numbers
// negative if the machine does not report them.
struct MachineFacts {
  int cores = 1;
  bool fifo_works = false, lock_works = false, slack_works = false;  // tried on a temporary thread
  long rtprio_limit = -1;                                            // ulimit -r; LONG_MAX: none
  long memlock_limit_kib = -1;                                       // ulimit -l; LONG_MAX: none
  std::vector<std::string> governors;                                // one for each core that has one
  std::string preemption;   // "rt", "full", "voluntary", "none", "dynamic" (chosen at boot, value unknown)
  long rt_runtime_us = -1;  // of every second that real-time threads may use; -1 reported by the machine: all
  bool rt_runtime_known = false;
  long timer_resolution_ns = -1;
  std::string clock_source;  // "tsc", "kvm-clock", …
  bool virtual_machine = false;
};
[[nodiscard]] MachineFacts look_at_machine(int priority);

enum class Finding { fine, note, lacking };  // a note: it works, but not as well as it could
struct MachineFinding {
  Finding kind = Finding::fine;
  std::string sentence;  // what was found
  std::string remedy;    // how to change it; empty if fine
};
// Judges these facts for a loop at this priority that locks about this much memory. Most important first.
[[nodiscard]] std::vector<MachineFinding> judge(const MachineFacts& facts, int priority, long memory_kib);

}  // namespace osteon
