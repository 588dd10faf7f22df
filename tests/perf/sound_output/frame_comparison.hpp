// Compares the frames that were rendered with those that came out of a sink.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace osteon::test {

struct Frame {
  float left = 0, right = 0;
  [[nodiscard]] bool silent() const noexcept { return left == 0 && right == 0; }
};
// Bit by bit.
[[nodiscard]] inline bool same(const Frame& a, const Frame& b) noexcept {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

// Frames, unless it is said otherwise.
struct FrameComparison {
  std::uint64_t equal = 0;  // bit by bit what was rendered, in its order
  // Runs of silence that nobody rendered: where they begin, among all frames that were heard.
  std::vector<std::size_t> gaps;
  std::uint64_t silent = 0;     // in these gaps
  std::uint64_t jumps = 0;      // number of places at which rendered frames are missing
  std::uint64_t missing = 0;    // there
  std::uint64_t differing = 0;  // neither silent nor rendered
};

// Both begin with their first sound. The rendered sound must not be silent after that: silence could not be told from a
// gap. After a gap, the sound goes on where it stopped, or further on by at most kFurthest_frames.
inline constexpr std::size_t kFurthest_frames = 96'000;
[[nodiscard]] FrameComparison compare(std::span<const Frame> rendered, std::span<const Frame> heard);

}  // namespace osteon::test
