// Sorts the CT slices of an input into series, checks each, and chooses one.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "server/import/dicom_header.hpp"
#include "server/import/found_files.hpp"
#include "server/import/series_report.hpp"
#include "server/import/slice_grid.hpp"

namespace osteon::import {

// Why a series is not a volume: a few words for the list, and the error of an import.
struct SeriesFault {
  std::string brief;
  Error error;
};

struct CtSeries {
  std::vector<DicomHeader> slices;  // sorted along the normal once the series has a grid
  SeriesEntry entry;
  SliceGrid grid;
  std::optional<SeriesFault> fault;
};

// One series for each SeriesInstanceUID, size, orientation and pixel spacing, so that an odd image does not spoil the
// rest. If positions repeat, a series is split by what distinguishes a scanner's passes: acquisition, time, kernel or
// kind of image. Series are numbered by SeriesNumber, then UID. `headers`: of all DICOM files. Files that are not
// slices of their own (copies, other kinds) are counted in `skipped`.
[[nodiscard]] std::vector<CtSeries> sort_series(std::vector<DicomHeader> headers, const FoundFiles& found,
                                                SkippedFiles& skipped);

// The index of the series to import: `number`, or else the series that contains `file`, or else the largest. If a
// larger series is of a kind that cannot be imported (colours, several frames without positions), one that can is
// preferred, unless it has only a few slices. A larger one with a missing or damaged slice is chosen, so that its fault
// is reported. Errors: invalid_input and unsupported (no CT, no such number). The chosen series may still have a fault.
[[nodiscard]] Result<std::size_t> choose_series(const std::vector<CtSeries>& series, const FoundFiles& found,
                                                const SkippedFiles& skipped, std::optional<int> number,
                                                std::optional<std::size_t> file);

}  // namespace osteon::import
