// The tools at the moment of playing. States come some 60 times a second, and late by a time that varies. Interpolation
// would wait for the next state; here the newest one is continued, which costs no time.
//
// A state carries the time of its sender's clock. The least difference between arrival and that time, over some
// seconds, is the offset of the clocks and the shortest way together. So a state that came late is continued further
// than one that came soon, and the tool moves evenly.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "audio_client/synth/sound_scene.hpp"

namespace osteon::audio {

// Least of the values of the last seconds. Clocks of two machines drift by less than 1 ms in that time.
class RecentLeast {
 public:
  void add(std::int64_t value, std::int64_t at_ns) noexcept;  // [audio]
  [[nodiscard]] std::int64_t least() const noexcept;          // the largest number before the first value

 private:
  static constexpr std::size_t kSlots = 8;  // of a second each
  struct Slot {
    std::int64_t second = -1;
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
  };
  std::array<Slot, kSlots> slots_{};
  std::int64_t newest_ = -1;  // second
};

class StateExtrapolator {
 public:
  // [audio] Takes the states of a scene. Ignored are those that are not newer than the known one of their tool. A
  // tool that is not in the scene is forgotten.
  void take(const SoundScene& scene) noexcept;

  // [audio] The tools at a time of our steady clock. Tip and depth go on with their velocity. Force, load and the like
  // go on as from the state before to the newest, unless the tool's phase has changed or a blow has come. None goes
  // beyond its limits. Places go on for two periods of the states at most, the rest for one. Phase, blows, seating,
  // thickness and what a breakthrough is known by are as they came. A state of unknown time stays as it came.
  [[nodiscard]] const SoundScene& at(std::int64_t now_ns) noexcept;
  // Whether the tools of at() change with time. If not, they are as they were taken.
  [[nodiscard]] bool moves() const noexcept;

 private:
  struct Track {
    ToolSound newest, before;
    bool has_before = false;
    std::int64_t received_ns = 0;  // of the newest
    std::int64_t period_ns = 0;    // of the states, smoothed; 0: not known yet
    RecentLeast offset_ns;         // arrival minus time
  };
  static void take(Track& track, const ToolSound& tool, std::int64_t received_ns) noexcept;
  static ToolSound continued(const Track& track, std::int64_t now_ns) noexcept;

  std::array<Track, kMaxTools> tracks_{};  // in the order of the scene
  SoundScene scene_;
};

}  // namespace osteon::audio
