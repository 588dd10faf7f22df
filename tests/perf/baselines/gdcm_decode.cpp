#include "tests/perf/baselines/gdcm_decode.hpp"

#include <gdcmAttribute.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace osteon::baselines {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// Along the normal of the slice.
double place_of(const std::filesystem::path& file) {
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010))) throw std::runtime_error(file.string() + " is no DICOM file");
  gdcm::Attribute<0x0020, 0x0032> position{};
  gdcm::Attribute<0x0020, 0x0037> orientation{};
  position.SetFromDataSet(reader.GetFile().GetDataSet());
  orientation.SetFromDataSet(reader.GetFile().GetDataSet());
  const double* o = orientation.GetValues();
  const double normal[] = {o[1] * o[5] - o[2] * o[4], o[2] * o[3] - o[0] * o[5], o[0] * o[4] - o[1] * o[3]};
  return std::inner_product(normal, normal + 3, position.GetValues(), 0.0);
}

std::vector<std::pair<double, std::filesystem::path>> sorted_slices(const std::filesystem::path& folder) {
  std::vector<std::pair<double, std::filesystem::path>> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.emplace_back(place_of(entry.path()), entry.path());
  std::ranges::sort(files);
  return files;
}

}  // namespace

GdcmSlice gdcm_slice(const std::filesystem::path& folder, std::size_t number) {
  const auto files = sorted_slices(folder);
  if (number >= files.size()) throw std::runtime_error(folder.string() + " has fewer slices");
  const std::filesystem::path& file = files[number].second;
  gdcm::ImageReader reader;
  reader.SetFileName(file.c_str());
  if (!reader.Read()) throw std::runtime_error(file.string() + " has no picture");
  const gdcm::Image& image = reader.GetImage();
  GdcmSlice slice{static_cast<int>(image.GetDimension(0)), static_cast<int>(image.GetDimension(1)), {}};
  std::vector<std::uint16_t> stored(image.GetBufferLength() / sizeof(std::uint16_t));
  if (image.GetPixelFormat().GetBitsAllocated() != 16 || !image.GetBuffer(reinterpret_cast<char*>(stored.data())))
    throw std::runtime_error(file.string() + " cannot be decoded");
  const bool is_signed = image.GetPixelFormat().GetPixelRepresentation() == 1;
  for (const std::uint16_t raw : stored)
    slice.hu.push_back((is_signed ? static_cast<std::int16_t>(raw) : int{raw}) * image.GetSlope() +
                       image.GetIntercept());
  return slice;
}

GdcmDecoded gdcm_decode(const std::filesystem::path& folder) {
  GdcmDecoded done;
  const auto begin = Clock::now();
  const auto files = sorted_slices(folder);
  done.headers_ms = ms_since(begin);

  const auto decoding = Clock::now();
  std::vector<std::int16_t> volume;
  std::size_t slice_bytes = 0;
  for (const auto& [place, file] : files) {
    gdcm::ImageReader reader;
    reader.SetFileName(file.c_str());
    if (!reader.Read()) throw std::runtime_error(file.string() + " has no picture");
    const gdcm::Image& image = reader.GetImage();
    if (volume.empty()) {
      slice_bytes = image.GetBufferLength();
      volume.resize(files.size() * slice_bytes / sizeof(std::int16_t));
    }
    const auto at = static_cast<std::size_t>(done.slices++) * slice_bytes / sizeof(std::int16_t);
    if (image.GetBufferLength() != slice_bytes || !image.GetBuffer(reinterpret_cast<char*>(volume.data() + at)))
      throw std::runtime_error(file.string() + " cannot be decoded");
  }
  done.decode_ms = ms_since(decoding);
  done.bytes = volume.size() * sizeof(std::int16_t);
  done.sum = std::accumulate(volume.begin(), volume.end(), std::int64_t{0});
  return done;
}

}  // namespace osteon::baselines
