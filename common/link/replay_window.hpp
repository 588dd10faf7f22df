// Tracks which counters of a peer were seen, to recognise replayed datagrams.
#pragma once
#include <array>
#include <cstdint>

namespace osteon {

// Covers the last kSpan counters up to the newest. Older counters count as seen. Uses the ring of RFC 6479, section 2:
// one word more than the window, so that an advance clears whole words and shifts nothing.
class ReplayWindow {
 public:
  static constexpr std::uint64_t kSpan = 2048;

  // Neither seen nor too old. Called before a datagram is authenticated; changes nothing.
  [[nodiscard]] bool is_fresh(std::uint64_t counter) const noexcept;
  // Called after authentication, only for fresh counters.
  void mark(std::uint64_t counter) noexcept;
  // Above all marked counters.
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
