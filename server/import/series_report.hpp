// The CT series of an input, the one that was taken, and the skipped files.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "server/import/skipped_files.hpp"

namespace osteon::import {

// Of voxels without a value, as beyond the round field of a scanner: air.
inline constexpr std::int16_t kPadding_hu = -1024;

struct SeriesEntry {
  int number = 0;           // 1 .. n, the argument of --series
  std::string description;  // from the scanner's operator; shown, never stored
  int slices = 0, rows = 0, columns = 0;
  double row_mm = 0.0, column_mm = 0.0, slice_mm = 0.0;  // between neighbours; 0 if unknown
  std::string plane;                                     // axial, coronal, sagittal, oblique
  std::string kernel;
  std::string irregularity;  // of slices that are resampled: "tilted by 18.5 degrees, 1 to 3 mm apart"
  int resampled = 0;         // slices of the grid to which they are resampled; 0: they are its planes
  int doubled = 0;           // slices left out, because another one lies at the same position
  int lossy = 0;             // slices that were compressed with loss
  std::string problem;       // why it cannot be imported
};

struct SeriesReport {
  std::vector<SeriesEntry> series;
  int taken = 0;  // its number; 0: none
  SkippedFiles skipped;
  std::int64_t without_number = 0;  // voxels that are NaN or infinite in the file; they have kPadding_hu
};

// "3 voxels have no finite number: they count as air"
[[nodiscard]] std::string without_number_text(const SeriesReport& report);

// "\"HEAD 1.0 H60s\", 180 slices, 512x512, 0.45x0.45x1 mm, axial, kernel H60s"
[[nodiscard]] std::string describe(const SeriesEntry& entry);

// Lines for the report of an import: the series taken, the others, the skipped files, and voxels without
// a number. Empty for an input without all of these.
[[nodiscard]] std::string report_lines(const SeriesReport& report);

// All series, one per line, with a mark at the one that would be taken; and the skipped files.
[[nodiscard]] std::string list_text(const SeriesReport& report);
[[nodiscard]] std::string list_json(const SeriesReport& report);

}  // namespace osteon::import
