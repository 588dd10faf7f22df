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

// What a transfer syntax does to the pixels.
enum class Compression : std::uint8_t {
  lossless,  // or none
  lossy,     // values differ from those that the scanner measured
  retired,   // decoders return noise without an error
  unknown,   // no decoder
};

struct DicomHeader {
  std::size_t file = 0;  // index among the found files
  std::uint64_t bytes = 0;
  std::uint64_t pixel_offset = 0;  // of the value of the pixel data; 0 in a deflated file
  FileKind kind = FileKind::damaged;
  std::string modality;

  // For a CT slice, and for one without pixels.
  Compression compression = Compression::lossless;
  std::string series, instance, transfer_syntax, photometric, image_type;
  std::string frame_of_reference;   // UID; compared with that of labels, never stored
  std::string description, kernel;  // safe to be shown
  int series_number = 0, acquisition = 0, temporal_position = 0;
  int frames = 1;  // of the file
  int frame = -1;  // of an enhanced image, from 0: the one that has this position; -1: the header is that of the file
  int columns = 0, rows = 0;
  bool is_hu = true;  // false: an enhanced image says that its numbers are something else, such as blood flow
  int bits_allocated = 0, bits_stored = 0, samples = 1;
  std::vector<double> position, orientation, spacing, slope, intercept;
  std::vector<double> padding;  // stored value of pixels that are not part of the scan

  // Frames that nothing but their order places.
  [[nodiscard]] bool has_frames_without_position() const { return frames > 1 && frame < 0; }
  void pack(ByteWriter& to) const;
  bool unpack(ByteReader& from);
};

// The header of a file, or one for each frame of an enhanced image. The library may abort on a damaged file, so call
// this in a process that may die.
[[nodiscard]] std::vector<DicomHeader> read_headers(const std::filesystem::path& file);

// `said_lossy`: the file says whether its pixels were ever compressed with loss (0028,2110); it counts for uncompressed
// pixels too, and for JPEG 2000, which can be either.
[[nodiscard]] Compression compression_of(std::string_view transfer_syntax, std::string_view said_lossy);

// Kind by SOP class, modality and image type, for a file that has pixels.
[[nodiscard]] FileKind kind_of(std::string_view sop_class, std::string_view modality, std::string_view image_type);

}  // namespace osteon::import
