// Sorts the CT slices of an input into series, checks each, and chooses one.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/imaging/hu_volume.hpp"
#include "server/import/dicom_header.hpp"
#include "server/import/found_files.hpp"
#include "server/import/series_report.hpp"

namespace osteon::import {

// Why a series is no volume: in a few words for the list, and as the error of an import.
struct SeriesFault {
  std::string brief;
  Error error;
};

struct CtSeries {
  std::vector<DicomHeader> slices;  // sorted along the normal, once it has a grid
  SeriesEntry entry;
  imaging::HuVolume grid;  // without values
  std::optional<SeriesFault> fault;
};

// One series for each SeriesInstanceUID, size, orientation and pixel spacing, so that an odd image does not spoil the
// rest. Where places repeat, it is parted by what tells the passes of a scanner apart (acquisition, time, kernel, kind
// of image). Numbered by SeriesNumber, then UID. `headers`: of all files that are DICOM; what is no slice of its own
// (copies, other kinds) is counted in `skipped`.
[[nodiscard]] std::vector<CtSeries> sort_series(std::vector<DicomHeader> headers, const FoundFiles& found,
                                                SkippedFiles& skipped);

// The index of the series to import: `number`, or else the one with `file` among its slices, or else the largest. One
// that can be imported goes before a larger one of a kind that cannot (tilted, several frames), unless only a few
// slices can. A larger one that lacks a slice or has a damaged one is chosen, so that its fault is told. Errors:
// invalid_input and unsupported (no CT, no such number). The chosen one may still have a fault.
[[nodiscard]] Result<std::size_t> choose_series(const std::vector<CtSeries>& series, const FoundFiles& found,
                                                const SkippedFiles& skipped, std::optional<int> number,
                                                std::optional<std::size_t> file);

}  // namespace osteon::import
