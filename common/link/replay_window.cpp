#include "common/link/replay_window.hpp"

#include <algorithm>

#include "common/core/check.hpp"

namespace osteon {

bool ReplayWindow::is_fresh(std::uint64_t counter) const noexcept {
  if (is_newest(counter)) return true;
  if (newest_ - counter >= kSpan) return false;
  return (seen_[counter / 64 % kWords] & bit(counter)) == 0;
}

void ReplayWindow::mark(std::uint64_t counter) noexcept {
  OSTEON_CHECK(is_fresh(counter));
  if (is_newest(counter)) {
    // Words that enter the window now still contain values from one turn of the ring ago.
    const std::uint64_t words = any_ ? std::min(counter / 64 - newest_ / 64, kWords) : 0;
    for (std::uint64_t i = 0; i < words; ++i) seen_[(counter / 64 - i) % kWords] = 0;
    newest_ = counter;
    any_ = true;
  }
  seen_[counter / 64 % kWords] |= bit(counter);
}

}  // namespace osteon
