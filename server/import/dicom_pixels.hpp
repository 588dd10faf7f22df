// Reads the pixels of CT slices.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
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
  // What a stored value means.
  struct Scale {
    double slope = 1.0, intercept = 0.0;
    bool is_signed = false;
    int unused = 0;                        // bits above the stored ones, which lack the sign
    std::optional<std::uint16_t> padding;  // this value is air

    [[nodiscard]] std::int16_t hu(std::uint16_t raw) const;
    friend bool operator==(const Scale&, const Scale&) = default;
  };
  Result<void> decode(const DicomHeader& h, const std::filesystem::path& file, const std::string& name);
  void set_scale(const Scale& scale);

  std::filesystem::path file_;
  std::vector<char> stored_;  // of all frames
  std::size_t width_ = 0;     // bytes of a pixel
  bool is_signed_ = false;
  int unused_ = 0;  // as in Scale
  Scale scale_;
  std::vector<std::int16_t> hu_;  // of each value that 16 bits hold, by the scale; empty: there was none yet
};

}  // namespace osteon::import
