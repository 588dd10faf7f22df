// Reads the pixels of CT slices.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "server/import/dicom_header.hpp"

namespace osteon::import {

// Has the pixels of the last file in memory, because the frames of a file follow each other.
class PixelReader {
 public:
  // Writes Hounsfield units, row by row, into `out`, which has one value for each pixel of the header. `name`: name of
  // the file, for people. The library may abort on a damaged file, so call this in a process that may die. Error:
  // invalid_input (no pixels, truncated, of another size, cannot be decompressed).
  [[nodiscard]] Result<void> read(const DicomHeader& h, const std::filesystem::path& file, const std::string& name,
                                  std::span<std::int16_t> out);

 private:
  Result<void> decode(const DicomHeader& h, const std::filesystem::path& file, const std::string& name);

  std::filesystem::path file_;
  std::vector<char> stored_;  // of all frames
  std::size_t width_ = 0;     // bytes of a pixel
  bool is_signed_ = false;
  int unused_ = 0;  // bits above the stored ones, which lack the sign
};

}  // namespace osteon::import
