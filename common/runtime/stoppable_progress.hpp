// Progress of work that a signal can stop.
#pragma once
#include <chrono>
#include <optional>

#include "common/runtime/progress.hpp"
#include "common/runtime/stop_signal.hpp"

namespace osteon {

// The bar appears with the first work, so that refused input prints only its sentence.
class StoppableProgress {
 public:
  // `quiet`: work that takes no longer shows no bar.
  StoppableProgress(const StopSignal& stop, const char* what, std::chrono::milliseconds quiet = {})
      : stop_(stop), what_(what), shown_from_(std::chrono::steady_clock::now() + quiet) {}
  // `done`: 0 to 1. False: the work shall stop.
  [[nodiscard]] bool go_on(double done) {
    if (done > 0.0 && !bar_ && std::chrono::steady_clock::now() >= shown_from_) bar_.emplace(what_);
    if (bar_) bar_->update(done);
    return !stop_.requested();
  }

 private:
  const StopSignal& stop_;
  const char* what_;
  std::chrono::steady_clock::time_point shown_from_;
  std::optional<Progress> bar_;
};

}  // namespace osteon
