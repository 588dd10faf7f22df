// How many random trials a test makes.
#pragma once
#include <cstdlib>
#include <string_view>

namespace osteon::test {

// With OSTEON_TRIALS=all, as deploy/nightly sets it.
[[nodiscard]] inline bool all_trials() {
  const char* asked = std::getenv("OSTEON_TRIALS");
  return asked != nullptr && std::string_view(asked) == "all";
}

// Otherwise few, so that deploy/test stays in its budget (decision 0052).
[[nodiscard]] inline unsigned trials(unsigned all, unsigned few) { return all_trials() ? all : few; }

// Few are a quarter. Expected counts are given in the same way.
[[nodiscard]] inline unsigned trials(unsigned all) { return trials(all, (all + 3) / 4); }

}  // namespace osteon::test
