// The result of a reader of CT files.
#pragma once
#include <string>

#include "common/imaging/hu_volume.hpp"
#include "server/import/series_report.hpp"

namespace osteon::import {

struct CtScan {
  imaging::HuVolume volume;
  std::string source = {};   // kind and geometry only: no name, date or number of a patient, nor the file's name
  SeriesReport report = {};  // for the person who imports; a case stores nothing of it
  std::string frame_of_reference = {};  // UID of DICOM, empty for others; compared with that of labels, never stored
};

}  // namespace osteon::import
