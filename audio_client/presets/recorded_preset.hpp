// A preset made from a recording by its spectral model: orders from the lines, the noise's envelope, the impacts.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "audio_client/presets/tool_model.hpp"
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

struct RecordedParams {
  std::string name;                // of the preset
  std::vector<std::string> tools;  // kinds or names that it is for; none: those of the base
  double rpm = 0;                  // of the spindle, or strokes a minute; 0: the rated speed of the base
  int refinements = 0;             // rounds, as in a spectral model
};

struct RecordedPreset {
  ToolModel model;
  std::string text;  // what was found, a line for each finding
};

// `base`: the preset of the group. It says what cannot be heard in one recording: gears, motor, loads, breakthrough.
// A tool that turns: the longest part that runs free gives lines and noise. Parts in cancellous and cortical bone, if
// there are any, give the changes of each source, with the threshold of 3 dB. A tool that is struck: the ringing after
// the blows gives the modes, and the blows themselves are kept, at most 20 ms each and a tenth of the recording.
// Errors: invalid_input if nothing runs, or nothing strikes; cancelled.
[[nodiscard]] Result<RecordedPreset> recorded_preset(
    std::span<const float> samples, int rate_hz, const ToolModel& base, const RecordedParams& params,
    const KeepGoing& keep_going = [](double) { return true; });

}  // namespace osteon::audio
