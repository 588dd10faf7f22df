// An analysis as text, as JSON, as tables, and as a folder with all of them.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "audio_client/analysis/analysis.hpp"
#include "audio_client/analysis/displacement_file.hpp"
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

// A few lines for a terminal.
[[nodiscard]] std::string to_text(const SoundAnalysis& analysis);
// Everything but signals and spectra. It names no file and no date.
[[nodiscard]] std::string to_json(const SoundAnalysis& analysis);

struct NamedTable {
  std::string file;  // NAME.csv
  std::string text;
};
// psd.csv, spectrogram.csv, packets.csv, states.csv, gears.csv, and bands.csv with levels over time.
[[nodiscard]] std::vector<NamedTable> tables_of(const SoundAnalysis& analysis,
                                                std::span<const DisplacementRow> displacement);

// Makes `folder` with analysis.json, the tables, the pictures, and difference.wav if there is a difference: as a whole
// or not at all. `keep_going` is called after each file. Errors: exists, internal (disk), cancelled.
[[nodiscard]] Result<void> write_analysis(const SoundAnalysis& analysis, std::span<const DisplacementRow> displacement,
                                          const std::filesystem::path& folder, const KeepGoing& keep_going);

}  // namespace osteon::audio
