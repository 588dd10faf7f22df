// What a user should know of a recording before trusting what is made of it.
#pragma once
#include <string>

#include "common/sound/wav_file.hpp"

namespace osteon::audio {

// A line each, which begins with "note": a header that announces more than is there, a coarse resolution, clipping.
// Empty for a good recording.
[[nodiscard]] std::string recording_notes(const sound::WavSound& recording);

}  // namespace osteon::audio
