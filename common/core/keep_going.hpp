// A callback that long work calls: it reports progress and can stop the work.
#pragma once
#include <functional>

namespace osteon {

// Asked often during long work, with the fraction done; false means that the user wants it stopped.
using KeepGoing = std::function<bool(double fraction)>;

// Maps the progress of one stage to a part of the whole, from `begin` to `end`; fractions. Keep `whole` alive as long.
[[nodiscard]] inline KeepGoing part(const KeepGoing& whole, double begin, double end) {
  return [&whole, begin, end](double fraction) { return whole(begin + (end - begin) * fraction); };
}

}  // namespace osteon
