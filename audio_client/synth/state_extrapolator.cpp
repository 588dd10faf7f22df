#include "audio_client/synth/state_extrapolator.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::audio {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
// How far ahead, in periods of the states. Forces change suddenly: one that went on falling for long would sound like a
// breakthrough.
constexpr std::int64_t kPlacePeriods = 2, kForcePeriods = 1;
// After a longer pause two states say nothing about what the tool does between them.
constexpr std::int64_t kLongestGap_ns = 100'000'000;
// A client that starts anew counts its states anew, perhaps on another machine. Nothing that the network delays comes
// so late after a newer one [A].
constexpr std::int64_t kNewSender_ns = 300'000'000;
// A delay does not grow so much at once: the sender has another clock.
constexpr std::int64_t kOtherClock_ns = kSecond_ns;
constexpr double kFastestTip_mm_per_s = 2000.0;  // of a hand [A]; a faster tool was taken up elsewhere

constexpr double kEndless = std::numeric_limits<double>::infinity();
struct Continued {
  double ToolSound::*number;
  double most;
};
constexpr Continued kContinued[] = {{&ToolSound::rpm, kMaxRpm},
                                    {&ToolSound::load, kMaxLoad},
                                    {&ToolSound::hardness, kMaxHardness},
                                    {&ToolSound::chips, kMaxChips},
                                    {&ToolSound::force_N, kEndless},
                                    {&ToolSound::torque_Nmm, kEndless},
                                    {&ToolSound::feed_mm_per_s, kEndless},
                                    {&ToolSound::density_g_cm3, kEndless}};

}  // namespace

void RecentLeast::add(std::int64_t value, std::int64_t at_ns) noexcept {
  const std::int64_t second = std::max<std::int64_t>(0, at_ns) / kSecond_ns;
  newest_ = std::max(newest_, second);
  Slot& slot = slots_[static_cast<std::size_t>(second) % kSlots];
  if (slot.second != second) slot = {second};
  slot.least = std::min(slot.least, value);
}

std::int64_t RecentLeast::least() const noexcept {
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (const Slot& slot : slots_)
    if (slot.second >= 0 && slot.second + static_cast<std::int64_t>(kSlots) > newest_)
      least = std::min(least, slot.least);
  return least;
}

void StateExtrapolator::take(const SoundScene& scene) noexcept {
  std::array<Track, kMaxTools> kept{};
  for (int t = 0; t < scene.count; ++t) {
    const ToolSound& tool = scene.tools[static_cast<std::size_t>(t)];
    const auto known = tracks_.begin() + scene_.count;
    const auto found =
        std::find_if(tracks_.begin(), known, [&](const Track& one) { return one.newest.author == tool.author; });
    Track& track = kept[static_cast<std::size_t>(t)];
    if (found != known)
      take(track = *found, tool, scene.received_ns);
    else
      take(track = {}, tool, scene.received_ns);
  }
  tracks_ = kept;
  scene_ = scene;
  for (int t = 0; t < scene.count; ++t)
    scene_.tools[static_cast<std::size_t>(t)] = tracks_[static_cast<std::size_t>(t)].newest;
}

void StateExtrapolator::take(Track& track, const ToolSound& tool, std::int64_t received_ns) noexcept {
  const bool timed = tool.time_ns > 0;
  const bool is_first = track.received_ns == 0;
  if (!is_first && timed && tool.state_seq <= track.newest.state_seq && tool.author == track.newest.author) {
    // What came before counts, unless its sender is gone: then this is a new one.
    const bool again = tool.state_seq == track.newest.state_seq && tool.time_ns == track.newest.time_ns;
    if (again || received_ns - track.received_ns < kNewSender_ns) return;
    track = {};
  }
  if (!is_first && timed && track.newest.time_ns > 0 &&
      received_ns - tool.time_ns > track.offset_ns.least() + kOtherClock_ns)
    track = {};
  const std::int64_t gap_ns = tool.time_ns - track.newest.time_ns;
  track.has_before = timed && track.received_ns != 0 && track.newest.time_ns > 0 && gap_ns > 0;
  if (track.has_before) track.before = track.newest;
  if (track.has_before && gap_ns <= kLongestGap_ns)
    track.period_ns = track.period_ns == 0 ? gap_ns : track.period_ns + (gap_ns - track.period_ns) / 8;
  track.newest = tool;
  track.received_ns = std::max<std::int64_t>(1, received_ns);
  if (timed) track.offset_ns.add(received_ns - tool.time_ns, received_ns);
}

const SoundScene& StateExtrapolator::at(std::int64_t now_ns) noexcept {
  for (int t = 0; t < scene_.count; ++t) {
    const auto i = static_cast<std::size_t>(t);
    scene_.tools[i] = continued(tracks_[i], now_ns);
  }
  return scene_;
}

bool StateExtrapolator::moves() const noexcept {
  return std::any_of(tracks_.begin(), tracks_.begin() + scene_.count, [](const Track& one) { return one.has_before; });
}

ToolSound StateExtrapolator::continued(const Track& track, std::int64_t now_ns) noexcept {
  const ToolSound &newest = track.newest, &before = track.before;
  ToolSound now = newest;
  const std::int64_t gap_ns = newest.time_ns - before.time_ns;
  const bool same_tool = newest.tool == before.tool && newest.handpiece == before.handpiece;
  if (!track.has_before || gap_ns > kLongestGap_ns || !same_tool || newest.blows != before.blows) return now;
  const std::int64_t since_ns = now_ns - track.offset_ns.least() - newest.time_ns;
  const std::int64_t ahead_ns = std::clamp<std::int64_t>(since_ns, 0, kPlacePeriods * track.period_ns);
  const double ahead = static_cast<double>(ahead_ns) / static_cast<double>(gap_ns);
  now.time_ns += ahead_ns;

  const Vec3 moved_mm = newest.tip_mm - before.tip_mm;
  if (moved_mm.norm() <= kFastestTip_mm_per_s * 1e-9 * static_cast<double>(gap_ns)) {
    now.tip_mm += ahead * moved_mm;
    // The tip's depth is along an axis, so it changes by no more than the tip moves. More is another entry.
    const double deeper_mm = newest.depth_mm - before.depth_mm;
    if (std::abs(deeper_mm) <= moved_mm.norm() + 1e-3) now.depth_mm += ahead * deeper_mm;
  }
  if (newest.phase != before.phase) return now;
  const double force_ahead =
      std::min(ahead, static_cast<double>(kForcePeriods * track.period_ns) / static_cast<double>(gap_ns));
  for (const auto& [number, most] : kContinued)
    now.*number = std::clamp(newest.*number + force_ahead * (newest.*number - before.*number), 0.0, most);
  now.load_ahead = now.load - newest.load;
  return now;
}

}  // namespace osteon::audio
