// What GDCM needs for the voxels of a folder of DICOM slices, used as its examples show.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace osteon::baselines {

struct GdcmDecoded {
  int slices = 0;
  std::size_t bytes = 0;  // of all slices as they were stored
  std::int64_t sum = 0;   // of all stored values, so that nothing of the work can be left out
  double headers_ms = 0.0, decode_ms = 0.0;
};

// One thread. First reads what is before the pixels of every file, and sorts the files by their places. Then decodes
// each into one volume. Throws std::runtime_error if a file is no slice of the first one's size.
[[nodiscard]] GdcmDecoded gdcm_decode(const std::filesystem::path& folder);

struct GdcmSlice {
  int columns = 0, rows = 0;
  std::vector<double> hu;  // columns fastest
};
// The slice of that number from 0 by its place. Throws std::runtime_error if there is none, or it has not 16 bits.
[[nodiscard]] GdcmSlice gdcm_slice(const std::filesystem::path& folder, std::size_t number);

}  // namespace osteon::baselines
