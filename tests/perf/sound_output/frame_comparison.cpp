#include "tests/perf/sound_output/frame_comparison.hpp"

#include <algorithm>

namespace osteon::test {
namespace {

// So many equal frames in a row are no accident.
constexpr std::size_t kRecognised_frames = 32;
// After so many the sounds are two different ones, and nobody needs to look further.
constexpr std::uint64_t kMostDiffering = 1000;

std::span<const Frame> from_first_sound(std::span<const Frame> frames) {
  const auto first = std::ranges::find_if_not(frames, &Frame::silent);
  return frames.subspan(static_cast<std::size_t>(first - frames.begin()));
}

}  // namespace

FrameComparison compare(std::span<const Frame> rendered, std::span<const Frame> heard) {
  rendered = from_first_sound(rendered);
  const std::size_t all = heard.size();
  heard = from_first_sound(heard);
  const std::size_t before = all - heard.size();
  FrameComparison found;
  bool in_gap = false;
  std::size_t r = 0;
  for (std::size_t h = 0; h < heard.size() && r < rendered.size(); ++h) {
    if (same(heard[h], rendered[r])) {
      ++found.equal;
      ++r;
      in_gap = false;
      continue;
    }
    if (heard[h].silent()) {
      if (!in_gap) found.gaps.push_back(before + h);
      ++found.silent;
      in_gap = true;
      continue;
    }
    in_gap = false;
    const std::span<const Frame> next = heard.subspan(h, std::min(kRecognised_frames, heard.size() - h));
    const std::span<const Frame> ahead = rendered.subspan(r, std::min(kFurthest_frames, rendered.size() - r));
    const auto place = std::ranges::search(ahead, next, same).begin();
    if (place == ahead.end()) {
      ++found.differing;
      ++r;
      if (found.differing < kMostDiffering) continue;
      found.differing += heard.size() - h - 1;
      break;
    }
    const auto missing = static_cast<std::size_t>(place - ahead.begin());
    ++found.jumps;
    found.missing += missing;
    ++found.equal;
    r += missing + 1;
  }
  return found;
}

}  // namespace osteon::test
