// A callback of long work. It reports progress and can stop the work.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"

namespace osteon {

// Called often during long work, with the fraction done. False means that the user wants to stop it.
using KeepGoing = std::function<bool(double fraction)>;

// Maps the progress of one stage to the part from `begin` to `end` of the whole; fractions. `whole` must outlive it.
[[nodiscard]] inline KeepGoing part(const KeepGoing& whole, double begin, double end) {
  return [&whole, begin, end](double fraction) { return whole(begin + (end - begin) * fraction); };
}

// The error of long work that the user stopped. `task`: what it did, such as "reading the scan".
[[nodiscard]] inline tl::unexpected<Error> stopped_while(const std::string& task) {
  return failure(ErrorCode::cancelled, "stopped while " + task);
}

}  // namespace osteon
