// Reads a CT series, one DICOM file for each slice, in the forms that hospitals provide: a folder, a zip or a CD image.
#pragma once
#include <filesystem>
#include <optional>

#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

struct SeriesOptions {
  std::optional<int> series;  // number in the list; absent: the largest that can be imported
};

// `input`: a folder with all that is in it, a zip, a tar or an ISO 9660 image. Or a DICOMDIR, whose folder is searched;
// or one slice, whose series is read. The content decides, never the name.
// Files are read in other processes. A file that crashes a library costs only that file, unless it is a slice of the
// series that is read. Slices are ordered by their position along the normal of their plane, never by file name or
// number. Other files than CT slices are counted in the report. Tilted and unevenly spaced slices are resampled to a
// regular grid (server/import/slice_grid.hpp).
// Input is refused if it makes the volume's shape or values doubtful: several frames in a file, missing slices,
// spacing, position, rescaling or pixels, retired compressions. Errors: not_found, invalid_input,
// unsupported, exhausted, cancelled, internal (temporary folder).
[[nodiscard]] Result<CtScan> read_dicom_series(const std::filesystem::path& input, const SeriesOptions& options,
                                               const KeepGoing& keep_going);
[[nodiscard]] inline Result<CtScan> read_dicom_series(const std::filesystem::path& input, const KeepGoing& keep_going) {
  return read_dicom_series(input, {}, keep_going);
}

// The series from which the same call would choose, without reading pixels. `taken` is 0 if none can be imported.
[[nodiscard]] Result<SeriesReport> list_dicom_series(const std::filesystem::path& input, const KeepGoing& keep_going);

// The same. Makes the folder, which must not exist, with series-N.png for each series N that can be imported: its
// middle slice in the window of bone. A series of which that slice cannot be read has no picture. `with_hu`: the HU of
// that slice, number slices / 2 from 0, too, in series-N.nrrd (server/import/raw_nrrd.hpp). A series that is resampled
// has none, because its slices are no planes of its volume. Errors: those above, exists.
[[nodiscard]] Result<SeriesReport> draw_dicom_series(const std::filesystem::path& input,
                                                     const std::filesystem::path& folder, bool with_hu,
                                                     const KeepGoing& keep_going);

}  // namespace osteon::import
