// A local socket between a window and the audio client of the same user. The window sends the volume, the client what
// it plays. Each message is one packet of JSON text. The newest message counts, so neither side waits.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/input/local_link.hpp"

namespace osteon {

inline constexpr std::size_t kMostWaveSamples = 512;
inline constexpr int kFullScale = 32767;  // of a sample

// From the window.
struct SoundSettings {
  double volume = 1.0;  // factor of the amplitude, 0 to 1
  bool on = true;       // false: silent
  friend bool operator==(const SoundSettings&, const SoundSettings&) = default;
};

// From the audio client.
struct SoundReport {
  std::vector<int> wave{};    // what was played last, oldest first; kFullScale is the amplitude 1
  double rate_hz = 48000.0;   // of the samples
  double level = 0;           // largest amplitude since the report before, 0 to 1
  double work_ms = 0;         // longest computation of a buffer since the report before
  double buffer_ms = 0;       // duration of a buffer; a longer computation makes a gap
  double latency_ms = 0;      // from a state of the tool to its sound, upper bound
  double gaps = 0;            // since the start
  double late_callbacks = 0;  // since the start: calls that came more than a buffer late, heard or not
  std::string device{};       // that plays it, such as PulseAudio; empty: none
  std::string trouble{};      // one sentence, such as why there is no device; empty: none
  friend bool operator==(const SoundReport&, const SoundReport&) = default;
};

// As text, and back. A text of more than 512 bytes is shortened, and of a longer wave the newest samples stay. Errors
// of reading, invalid_input: another version; a field that is missing, of another type, not finite, out of its range,
// or too long.
[[nodiscard]] std::string encode(const SoundSettings& settings);
[[nodiscard]] std::string encode(const SoundReport& report);
[[nodiscard]] Result<SoundSettings> read_sound_settings(std::string_view text);
[[nodiscard]] Result<SoundReport> read_sound_report(std::string_view text);

[[nodiscard]] LocalLinkNames sound_link_names();

// The window's end, and the audio client's.
using SoundServer = LocalMessageServer<SoundSettings, SoundReport, read_sound_report, sound_link_names>;
using SoundClient = LocalMessageClient<SoundReport, SoundSettings, read_sound_settings, sound_link_names>;

}  // namespace osteon
