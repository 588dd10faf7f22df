// The sinks and sources of a sound server, and how a user names one.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::audio {

// A sink or source: all that RtAudio 5.2 tells of it. It does not tell the server's own short name, the latency, or
// whether anything is plugged in.
struct SoundDevice {
  std::string name;  // the server's description, such as "Built-in Audio Analog Stereo"
  unsigned channels = 0;
  unsigned rate_hz = 0;  // at which it runs; other rates are converted by the server
  bool is_default = false;
};

// The one that `wanted` means: its name, its number from 0, or a part of its name that no other has. A name counts
// before a number, and a number before a part. Empty: the default one. `kind`: "sink" or "source", for messages.
// Errors, invalid_input: there is none, or several have this name or part.
[[nodiscard]] Result<std::size_t> chosen_device(const std::vector<SoundDevice>& devices, const std::string& wanted,
                                                std::string_view kind);

}  // namespace osteon::audio
