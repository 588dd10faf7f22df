// Which counters of a peer have been seen, so that a datagram that somebody sends again is known.
#pragma once
#include <array>
#include <cstdint>

namespace osteon {

// The last kSpan counters up to the newest; what is older counts as seen. The ring of RFC 6479, section 2: one word
// more than the window has, so that moving on clears whole words and shifts nothing.
class ReplayWindow {
 public:
  static constexpr std::uint64_t kSpan = 2048;

  // Neither seen nor too old. Asked before a datagram is authenticated; nothing changes.
  [[nodiscard]] bool is_fresh(std::uint64_t counter) const noexcept;
  // After it was authenticated, and only of fresh ones.
  void mark(std::uint64_t counter) noexcept;
  // Above all that were marked.
  [[nodiscard]] bool is_newest(std::uint64_t counter) const noexcept { return !any_ || counter > newest_; }

 private:
  static constexpr std::uint64_t kWords = kSpan / 64 + 1;
  [[nodiscard]] static constexpr std::uint64_t bit(std::uint64_t counter) noexcept {
    return std::uint64_t{1} << counter % 64;
  }

  std::array<std::uint64_t, kWords> seen_{};  // word of counter c: c / 64 mod kWords
  std::uint64_t newest_ = 0;
  bool any_ = false;
};

}  // namespace osteon
