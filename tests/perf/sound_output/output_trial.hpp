// What both measurements of the output share: how it is played, and by which engine.
#pragma once
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/space/sound_path.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "common/core/result.hpp"

namespace osteon::test {

inline constexpr double kOutputRate_hz = 48000;
inline constexpr const char* kSink = "virt";  // of deploy/with-null-sink

struct OutputTrial {
  std::string listen = "loudspeakers";
  audio::OutputParams output;  // as osteon-audio has it, unless it is said otherwise
  bool awake = false;          // keeps the processors from sleeping
  double minutes = 10;
  std::size_t cuts = 300;
};

// The usual listener of a bone in the middle of its frame. Errors: those of the head's file.
[[nodiscard]] Result<audio::SynthParams> synth_of(const OutputTrial& trial);
[[nodiscard]] nlohmann::json described(const OutputTrial& trial);

// Plays a drilling for some minutes and compares what was rendered with what came out. Errors: unavailable.
[[nodiscard]] Result<nlohmann::json> play_without_gaps(const OutputTrial& trial);
// The time from a cut in a server to the first changed sample. Errors: unavailable.
[[nodiscard]] Result<nlohmann::json> time_cuts(const OutputTrial& trial);

}  // namespace osteon::test
