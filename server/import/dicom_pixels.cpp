#include "server/import/dicom_pixels.hpp"

#include <gdcmImageReader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <vector>

#include "common/imaging/hu_volume.hpp"
#include "server/import/series_report.hpp"

namespace osteon::import {
namespace {

constexpr double kBrightPadding_hu = 100.0;
constexpr double kLargestStored = 65535.0;

namespace fs = std::filesystem;

const gdcm::Tag kPixels(0x7fe0, 0x0010);

std::uint32_t little_endian(const unsigned char* bytes, int count) {
  std::uint32_t value = 0;
  for (int i = count - 1; i >= 0; --i) value = value << 8 | bytes[i];
  return value;
}

// The library accepts a file that ends within its pixels as complete, and leaves the rest zero.
bool pixels_are_whole(const DicomHeader& h, const fs::path& file, std::uint64_t plain_bytes) {
  if (h.pixel_offset == 0) return true;  // deflated: the stream itself knows its end
  const bool is_plain = h.transfer_syntax.empty() || h.transfer_syntax == "1.2.840.10008.1.2" ||
                        h.transfer_syntax.starts_with("1.2.840.10008.1.2.1") ||
                        h.transfer_syntax == "1.2.840.10008.1.2.2";
  if (is_plain) return h.pixel_offset + plain_bytes <= h.bytes;
  // Compressed pixels are items, each with its length; the last has none.
  std::ifstream in(file, std::ios::binary);
  std::uint64_t at = h.pixel_offset;
  while (at + 8 <= h.bytes) {
    std::array<unsigned char, 8> item{};
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(reinterpret_cast<char*>(item.data()), item.size())) return false;
    if (little_endian(item.data(), 2) != 0xfffe || little_endian(item.data() + 2, 2) != 0xe000) return true;
    at += 8 + little_endian(item.data() + 4, 4);
  }
  return at <= h.bytes;
}

}  // namespace

Result<void> PixelReader::decode(const DicomHeader& h, const fs::path& file, const std::string& name) {
  const auto broken = [&](const std::string& why) {
    return failure(ErrorCode::invalid_input, name + " " + why + "; copy or export the series again");
  };
  file_.clear();
  gdcm::ImageReader reader;
  reader.SetFileName(file.c_str());
  const bool read = reader.Read();
  if (!reader.GetFile().GetDataSet().FindDataElement(kPixels)) return broken("has no pixel data");
  if (!read) return broken("has pixel data that cannot be read");
  const gdcm::Image& image = reader.GetImage();
  const std::size_t pixels = static_cast<std::size_t>(h.columns) * static_cast<std::size_t>(h.rows) *
                             static_cast<std::size_t>(h.frame < 0 ? 1 : h.frames);
  width_ = image.GetPixelFormat().GetBitsAllocated() / 8u;
  if ((width_ != 1 && width_ != 2) || image.GetBufferLength() != pixels * width_)
    return broken("has pixel data of another size than its header says");
  if (!pixels_are_whole(h, file, pixels * width_)) return broken("is cut off within its pixel data");
  // Some scanners write metal beyond the range of BitsStored. The library would cut those bits off and so turn metal
  // into air. So plain pixels are taken as they are in the file.
  stored_.resize(image.GetBufferLength());
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  const gdcm::ByteValue* bytes = image.GetDataElement().GetByteValue();
  const bool plain = (syntax == gdcm::TransferSyntax::ImplicitVRLittleEndian ||
                      syntax == gdcm::TransferSyntax::ExplicitVRLittleEndian) &&
                     image.GetNumberOfOverlays() == 0 && bytes != nullptr && bytes->GetLength() >= stored_.size();
  if (plain)
    std::memcpy(stored_.data(), bytes->GetPointer(), stored_.size());
  else if (!image.GetBuffer(stored_.data()))
    return broken("has pixel data that cannot be decompressed");
  is_signed_ = image.GetPixelFormat().GetPixelRepresentation() == 1;
  unused_ = is_signed_ ? std::clamp(16 - static_cast<int>(image.GetPixelFormat().GetBitsStored()), 0, 15) : 0;
  file_ = file;
  return {};
}

std::int16_t PixelReader::Scale::hu(std::uint16_t raw) const {
  if (raw == padding) return kPadding_hu;
  // Signed values may lack their sign in the bits above the stored ones.
  const int stored = is_signed ? static_cast<std::int16_t>(static_cast<std::uint16_t>(raw << unused)) >> unused : raw;
  return imaging::nearest_hu(stored * slope + intercept);
}

// Mostly, a slice has more pixels than there are values, and its neighbour has the same scale.
void PixelReader::set_scale(const Scale& scale) {
  if (scale == scale_ && !hu_.empty()) return;
  scale_ = scale;
  hu_.resize(std::size_t{1} << 16);
  for (std::size_t raw = 0; raw < hu_.size(); ++raw) hu_[raw] = scale.hu(static_cast<std::uint16_t>(raw));
}

Result<void> PixelReader::read(const DicomHeader& h, const fs::path& file, const std::string& name,
                               std::span<std::int16_t> out) try {
  if (file_ != file)
    if (auto decoded = decode(h, file, name); !decoded) return decoded;
  const std::size_t first = out.size() * width_ * static_cast<std::size_t>(std::max(h.frame, 0));
  if (first + out.size() * width_ > stored_.size())
    return failure(ErrorCode::invalid_input, name + " has fewer frames than its header says; export it again");
  const std::span<const char> buffer(stored_.data() + first, out.size() * width_);
  // Padding counts as air, but only if it would be bright: some files name a value that real pixels have too.
  const bool has_padding = h.padding.size() == 1 && std::abs(h.padding[0]) <= kLargestStored &&
                           h.padding[0] * h.slope[0] + h.intercept[0] > kBrightPadding_hu;
  Scale scale{h.slope[0], h.intercept[0], is_signed_, unused_, {}};
  if (has_padding) scale.padding = static_cast<std::uint16_t>(static_cast<std::int64_t>(h.padding[0]));
  set_scale(scale);
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::uint16_t raw = static_cast<std::uint8_t>(buffer[i]);
    if (width_ == 2) std::memcpy(&raw, buffer.data() + 2 * i, 2);
    out[i] = hu_[raw];
  }
  return {};
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::invalid_input,
                 name + " has pixel data that take too much memory; copy or export the series again");
} catch (const std::exception&) {
  return failure(ErrorCode::invalid_input,
                 name + " has pixel data that cannot be read; copy or export the series again");
}

}  // namespace osteon::import
