// SIGINT and SIGTERM as a flag, and SIGHUP if asked. Any thread may read it, and one thread may wait for it.
#pragma once
#include <chrono>

namespace osteon {

// One per process, made in main before other threads start. A second signal does not end the process, because an
// impatient person must not leave half-written files. It may shorten a wait. SIGQUIT still ends a process that hangs.
class StopSignal {
 public:
  // What the end of the terminal does (SIGHUP). A program that was started by nohup goes on in either case.
  enum class HangUp : bool { ends, stops };

  explicit StopSignal(HangUp hang_up = HangUp::ends);
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  [[nodiscard]] bool requested() const noexcept;
  void request() noexcept;  // as if a signal had arrived
  // True if a stop was requested before the time was over.
  bool wait_for(std::chrono::milliseconds time) const;
  // The same for a second request.
  bool wait_for_second(std::chrono::milliseconds time) const;
};

}  // namespace osteon
