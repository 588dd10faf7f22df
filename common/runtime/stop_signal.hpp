// SIGINT and SIGTERM as a flag that any thread may read and one may wait for.
#pragma once
#include <chrono>

namespace osteon {

// One per process, made in main before other threads start. A second signal ends nothing by itself: an impatient person
// must not leave half-written files; it may shorten a wait. SIGQUIT still ends a process that hangs.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  [[nodiscard]] bool requested() const noexcept;
  void request() noexcept;  // as if a signal had come
  // True when a stop was requested before the time was over.
  bool wait_for(std::chrono::milliseconds time) const;
  // The same, of a second request.
  bool wait_for_second(std::chrono::milliseconds time) const;
};

}  // namespace osteon
