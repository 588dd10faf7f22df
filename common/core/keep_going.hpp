// How long work is stopped by whoever asked for it, and tells how far it is.
#pragma once
#include <functional>

namespace osteon {

// Asked often during long work, with the fraction done; false means that the user wants it stopped.
using KeepGoing = std::function<bool(double fraction)>;

// The question of a stage that takes the whole's from `begin` to `end`; fractions. `whole` must outlive it.
[[nodiscard]] inline KeepGoing part(const KeepGoing& whole, double begin, double end) {
  return [&whole, begin, end](double fraction) { return whole(begin + (end - begin) * fraction); };
}

}  // namespace osteon
