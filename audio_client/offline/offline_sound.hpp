// The sound of a recorded session, faster than it sounds: the same samples that the live engine makes of these states.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "audio_client/offline/state_record.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

struct OfflineSound {
  std::uint64_t frames = 0, states = 0;
  float peak = 0;
};

// Takes the next frames of both channels, in order. In mono both are equal.
using TakeFrames = std::function<Result<void>(std::span<const float> left, std::span<const float> right)>;

// By so much the sound is longer than its record: the tool runs down, and a buffer is filled.
inline constexpr double kLongestTail_s = 2.1;

// The sound begins with the first state. Every buffer of the live client's size takes the states that are there when
// the buffer begins, and continues them to then. Where no state comes for 2 s, and at the end, the tool runs down as it
// does live. `record_s`: as in RecordedWork, if it is known. Then the progress is that of the sound's time, otherwise
// of the reading. Errors: those of the record and of `take`, and cancelled.
[[nodiscard]] Result<OfflineSound> render_states(StateRecord& record, const SynthParams& params, const TakeFrames& take,
                                                 const KeepGoing& keep_going, std::optional<double> record_s = {});

struct RecordedWork {
  Vec3 middle_mm = Vec3::Zero();  // the mean place of the tip while it touched bone; if it never did, of all states
  double seconds = 0;             // from the first state to the last
};

// What must be known before the sound is made: where a listener looks, and how long it becomes. Reads the whole record,
// which then has no further state. Errors: those of the record, and cancelled.
[[nodiscard]] Result<RecordedWork> survey(StateRecord& record, const KeepGoing& keep_going);

}  // namespace osteon::audio
