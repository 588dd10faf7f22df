// The sound of a recorded session, faster than it sounds: the same samples that the live engine makes of these states.
#pragma once
#include <cstdint>
#include <functional>
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

// Takes the next frames, in order.
using TakeFrames = std::function<Result<void>(std::span<const float> frames)>;

// The sound begins with the first state. Every buffer of the live client's size takes the states that are there when
// the buffer begins, and continues them to then. Where no state comes for 2 s, and at the end, the tool runs down as it
// does live. Errors: those of the record and of `take`, and cancelled.
[[nodiscard]] Result<OfflineSound> render_states(StateRecord& record, const SynthParams& params, const TakeFrames& take,
                                                 const KeepGoing& keep_going);

}  // namespace osteon::audio
