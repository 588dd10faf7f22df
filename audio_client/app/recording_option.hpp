// The recording that a command reads: its file, and which channel and part of it.
#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "common/core/result.hpp"
#include "common/sound/wav_file.hpp"

namespace osteon::audio {

struct RecordingOption {
  std::string file, channel;
  double from_s = 0;
  std::optional<double> to_s;
};

// A number without a sign, at most 2^64 - 1. CLI11 takes -1 for the largest one.
[[nodiscard]] CLI::Validator whole_number();

// A name of a file that is written: an empty one would only be noticed after the work.
[[nodiscard]] CLI::Validator given_name();

// Adds FILE, --channel, --from and --to. `recording` outlives `command`.
void add_recording(CLI::App& command, RecordingOption& recording);

// invalid_input if there is no such channel; otherwise as sound::read_wav().
[[nodiscard]] Result<sound::WavSound> read(const RecordingOption& recording);

}  // namespace osteon::audio
