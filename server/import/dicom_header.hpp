// The header of a DICOM file, read before its pixels.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/byte_stream.hpp"
#include "server/import/skipped_files.hpp"

namespace osteon::import {

struct DicomHeader {
  std::size_t file = 0;  // index among the found files
  std::uint64_t bytes = 0;
  std::uint64_t pixel_offset = 0;  // of the value of the pixel data; 0 in a deflated file
  FileKind kind = FileKind::damaged;
  std::string modality;

  // For a CT slice, and for one without pixels.
  std::string series, instance, transfer_syntax, photometric, image_type;
  std::string frame_of_reference;   // UID; compared with that of labels, never stored
  std::string description, kernel;  // safe to be shown
  int series_number = 0, acquisition = 0, temporal_position = 0;
  int frames = 1;
  int columns = 0, rows = 0;
  int bits_allocated = 0, bits_stored = 0, samples = 1;
  std::vector<double> position, orientation, spacing, slope, intercept;
  std::vector<double> padding;  // stored value of pixels that are not part of the scan

  void pack(ByteWriter& to) const;
  bool unpack(ByteReader& from);
};

// The library may abort on a damaged file, so call this in a process that may die.
[[nodiscard]] DicomHeader read_header(const std::filesystem::path& file);

// Kind by SOP class, modality and image type, for a file that has pixels.
[[nodiscard]] FileKind kind_of(std::string_view sop_class, std::string_view modality, std::string_view image_type);

}  // namespace osteon::import
