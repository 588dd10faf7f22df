// The frames of an enhanced multi-frame image.
#pragma once
#include <vector>

#include "server/import/dicom_header.hpp"

namespace gdcm {  // the library's
class File;
}

namespace osteon::import {

// One header for each frame, in the order of the file: `h` with the frame's position, orientation, pixel spacing,
// rescaling, acquisition and time from the functional groups (DICOM PS3.3 C.7.6.16), those of the frame before those
// that all frames share. Empty if the file has no such groups for each of its frames.
[[nodiscard]] std::vector<DicomHeader> frames_of(const DicomHeader& h, const gdcm::File& file);

}  // namespace osteon::import
