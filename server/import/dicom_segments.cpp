#include "server/import/dicom_segments.hpp"

#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <set>
#include <string_view>

#include "common/geometry/pose.hpp"
#include "common/imaging/hu_volume.hpp"
#include "server/import/found_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSegmentationStorage = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* kLabelMapStorage = "1.2.840.10008.5.1.4.1.1.66.7";
constexpr std::size_t kMostSegmentFrames = 1'000'000, kMostSegments = 65535, kShownSegmentLetters = 64;
constexpr double kMostTilt = 1e-3;      // of a cosine between the axes
constexpr double kMostShift_mm = 0.01;  // of a frame within its plane, against the first
constexpr double kMostUneven = 0.05;    // of the distance between slices, for a frame between two
constexpr double kLeastGap_mm = 1e-3;   // frames that are closer lie in one slice

// A fault of the file. Thrown while it is read, and caught in this file.
struct SegFault {
  ErrorCode code = ErrorCode::invalid_input;
  std::string what;
};

using Items = gdcm::SmartPointer<gdcm::SequenceOfItems>;

// The items of a sequence; null if there is none.
Items items_of(const gdcm::DataSet& data, std::uint16_t group, std::uint16_t element) {
  const gdcm::Tag tag(group, element);
  return data.FindDataElement(tag) ? data.GetDataElement(tag).GetValueAsSQ() : Items();
}

// The first item of a sequence, if there is one. GDCM may make the items when they are asked for, so they are kept.
class FirstItem {
 public:
  FirstItem() = default;
  FirstItem(const gdcm::DataSet* data, std::uint16_t group, std::uint16_t element) {
    if (data != nullptr) items_ = items_of(*data, group, element);
  }
  [[nodiscard]] const gdcm::DataSet* data() const {
    return items_ && items_->GetNumberOfItems() > 0 ? &items_->GetItem(1).GetNestedDataSet() : nullptr;
  }

 private:
  Items items_;
};

std::string text_of(const gdcm::DataSet* data, std::uint16_t group, std::uint16_t element) {
  const gdcm::Tag tag(group, element);
  if (data == nullptr || !data->FindDataElement(tag)) return "";
  const gdcm::ByteValue* bytes = data->GetDataElement(tag).GetByteValue();
  if (bytes == nullptr || bytes->GetPointer() == nullptr) return "";
  std::string text(bytes->GetPointer(), bytes->GetLength());
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

// Decimal numbers, separated by backslashes. Empty if any is not one.
std::vector<double> decimals_of(const gdcm::DataSet* data, std::uint16_t group, std::uint16_t element) {
  const std::string text = text_of(data, group, element);
  std::vector<double> numbers;
  for (const char* at = text.c_str(); *at != '\0';) {
    char* stop = nullptr;
    numbers.push_back(std::strtod(at, &stop));
    while (*stop == ' ') ++stop;
    if (stop == at || !std::isfinite(numbers.back()) || (*stop != '\0' && *stop != '\\')) return {};
    at = *stop == '\0' ? stop : stop + 1;
  }
  return numbers;
}

// A 16-bit number; 0 if there is none.
int short_of(const gdcm::DataSet* data, std::uint16_t group, std::uint16_t element) {
  const gdcm::Tag tag(group, element);
  if (data == nullptr || !data->FindDataElement(tag)) return 0;
  const gdcm::ByteValue* bytes = data->GetDataElement(tag).GetByteValue();
  std::uint16_t value = 0;
  if (bytes == nullptr || bytes->GetLength() < sizeof value) return 0;
  std::memcpy(&value, bytes->GetPointer(), sizeof value);
  return value;
}

// Where a frame lies, and the number of its segment.
struct SegFrame {
  Vec3 position_mm = Vec3::Zero();
  int segment = 0;
  int slice = 0;
};

class Segmentation {
 public:
  explicit Segmentation(const gdcm::File& file) : data_(file.GetDataSet()), file_(file) {
    check_kind();
    header_.frame_of_reference = text_of(&data_, 0x0020, 0x0052);
    header_.dims = {short_of(&data_, 0x0028, 0x0011), short_of(&data_, 0x0028, 0x0010), 0};
    if (header_.dims[0] < 1 || header_.dims[1] < 1) throw SegFault{.what = "has no rows or columns"};
    read_segments();
    read_frames();
    place_slices();
    check_pixels();
  }

  [[nodiscard]] const DicomSegmentation& header() const { return header_; }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }
  [[nodiscard]] std::size_t segment(std::size_t frame) const {
    const auto found = std::ranges::find(header_.segments, frames_[frame].segment, &DicomSegment::number);
    return static_cast<std::size_t>(found - header_.segments.begin());
  }
  // Bits follow each other without gaps, also from frame to frame, the lowest bit of a byte first.
  [[nodiscard]] std::vector<imaging::VoxelRun> runs(std::size_t frame) const {
    const auto [columns, rows, slices] = header_.dims;
    std::size_t bit = frame * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    std::vector<imaging::VoxelRun> runs;
    for (int row = 0; row < rows; ++row) {
      int first = -1;
      for (int column = 0; column < columns; ++column, ++bit) {
        const bool in = (static_cast<unsigned char>(pixels_[bit / 8]) >> (bit % 8) & 1U) != 0;
        if (in && first < 0) first = column;
        if (!in && first >= 0) runs.push_back({first, column - 1, row, frames_[frame].slice, 0});
        if (!in) first = -1;
      }
      if (first >= 0) runs.push_back({first, columns - 1, row, frames_[frame].slice, 0});
    }
    return runs;
  }

 private:
  void check_kind() const {
    const std::string sop_class = text_of(&data_, 0x0008, 0x0016);
    if (sop_class == kLabelMapStorage)
      throw SegFault{ErrorCode::unsupported, "is a label map of DICOM; export binary segments, NIfTI or .seg.nrrd"};
    if (sop_class != kSegmentationStorage) throw SegFault{.what = "is no DICOM SEG; give one, NIfTI or .seg.nrrd"};
    const std::string type = text_of(&data_, 0x0062, 0x0001);
    if (type != "BINARY" || short_of(&data_, 0x0028, 0x0100) != 1)
      throw SegFault{ErrorCode::unsupported, "has fractional segments; export binary ones, NIfTI or .seg.nrrd"};
    const gdcm::TransferSyntax& syntax = file_.GetHeader().GetDataSetTransferSyntax();
    if (syntax != gdcm::TransferSyntax::ImplicitVRLittleEndian &&
        syntax != gdcm::TransferSyntax::ExplicitVRLittleEndian &&
        syntax != gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian)
      throw SegFault{ErrorCode::unsupported, "is compressed or big-endian; export it uncompressed, NIfTI or .seg.nrrd"};
  }

  void read_segments() {
    const bool latin1 = text_of(&data_, 0x0008, 0x0005).find("100") != std::string::npos;
    const auto shown = [&](const std::string& text) { return shown_text(text, kShownSegmentLetters, latin1); };
    const Items items = items_of(data_, 0x0062, 0x0002);
    const std::size_t count = items ? items->GetNumberOfItems() : 0;
    if (count == 0 || count > kMostSegments) throw SegFault{.what = "has no segments"};
    std::set<int> numbers;
    for (std::size_t i = 1; i <= count; ++i) {
      const gdcm::DataSet& item = items->GetItem(i).GetNestedDataSet();
      DicomSegment segment{short_of(&item, 0x0062, 0x0004), shown(text_of(&item, 0x0062, 0x0005)), ""};
      segment.type = shown(text_of(FirstItem(&item, 0x0062, 0x000f).data(), 0x0008, 0x0104));
      if (segment.number == 0 || !numbers.insert(segment.number).second)
        throw SegFault{.what = "has a segment without a number of its own"};
      header_.segments.push_back(std::move(segment));
    }
  }

  // An attribute of a frame lies in a group of its own, or of all frames.
  void read_frames() {
    const FirstItem shared(&data_, 0x5200, 0x9229);
    const Items per_frame = items_of(data_, 0x5200, 0x9230);
    const std::size_t count = per_frame ? per_frame->GetNumberOfItems() : 0;
    const std::vector<double> told = decimals_of(&data_, 0x0028, 0x0008);
    if (count == 0 || count > kMostSegmentFrames || told.size() != 1 || told[0] != static_cast<double>(count))
      throw SegFault{.what = "does not say where each of its frames lies"};
    for (std::size_t i = 1; i <= count; ++i) {
      const gdcm::DataSet* own = &per_frame->GetItem(i).GetNestedDataSet();
      const auto group = [&](std::uint16_t g, std::uint16_t e) {
        const FirstItem item(own, g, e);
        return item.data() != nullptr ? item : FirstItem(shared.data(), g, e);
      };
      SegFrame frame;
      const auto position = decimals_of(group(0x0020, 0x9113).data(), 0x0020, 0x0032);
      const auto axes = decimals_of(group(0x0020, 0x9116).data(), 0x0020, 0x0037);
      if (position.size() != 3 || axes.size() != 6)
        throw SegFault{.what = "has a frame without its position or orientation"};
      frame.position_mm = {position[0], position[1], position[2]};
      frame.segment = short_of(group(0x0062, 0x000a).data(), 0x0062, 0x000b);
      if (std::ranges::find(header_.segments, frame.segment, &DicomSegment::number) == header_.segments.end())
        throw SegFault{.what = "has a frame of segment " + std::to_string(frame.segment) + ", which it does not list"};
      if (i == 1) {
        std::ranges::copy(axes, header_.axes.begin());
        read_spacing(group(0x0028, 0x9110).data());
      } else if (!std::ranges::equal(axes, header_.axes, [](double a, double b) { return std::abs(a - b) < 1e-4; })) {
        throw SegFault{.what = "has frames in different directions"};
      }
      frames_.push_back(frame);
    }
  }

  void read_spacing(const gdcm::DataSet* measures) {
    const auto spacing = decimals_of(measures, 0x0028, 0x0030);  // between rows, then between columns
    if (spacing.size() != 2 || !(spacing[0] > 0.0) || !(spacing[1] > 0.0))
      throw SegFault{.what = "does not say the size of its pixels"};
    header_.spacing_mm = {spacing[1], spacing[0], 0.0};
    for (const std::uint16_t element : {std::uint16_t{0x0088}, std::uint16_t{0x0050}})  // between slices; thickness
      if (const auto gap = decimals_of(measures, 0x0018, element);
          header_.spacing_mm[2] == 0.0 && gap.size() == 1 && gap[0] > 0.0)
        header_.spacing_mm[2] = gap[0];
  }

  // Slices along the normal of the planes. Frames of empty slices are often missing.
  void place_slices() {
    const Vec3 along_row(header_.axes[0], header_.axes[1], header_.axes[2]);
    const Vec3 along_column(header_.axes[3], header_.axes[4], header_.axes[5]);
    if (!(std::abs(along_row.norm() - 1.0) < kMostTilt) || !(std::abs(along_column.norm() - 1.0) < kMostTilt) ||
        !(std::abs(along_row.dot(along_column)) < kMostTilt))
      throw SegFault{.what = "has rows and columns that are not at right angles"};
    const Vec3 normal = along_row.cross(along_column).normalized(), first = frames_.front().position_mm;
    std::vector<double> depths_mm;
    for (const SegFrame& frame : frames_) {
      const Vec3 offset = frame.position_mm - first;
      const double depth = offset.dot(normal);
      if ((offset - depth * normal).norm() > kMostShift_mm)
        throw SegFault{.what = "has frames that do not lie above each other"};
      depths_mm.push_back(depth);
    }
    std::vector<double> sorted = depths_mm;
    std::ranges::sort(sorted);
    double least_mm = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < sorted.size(); ++i)
      if (const double gap = sorted[i] - sorted[i - 1]; gap > kLeastGap_mm) least_mm = std::min(least_mm, gap);
    double& spacing_mm = header_.spacing_mm[2];
    // What the file says counts if the frames fit.
    const auto fits = [&](double gap) {
      return gap > 0.0 && std::ranges::all_of(sorted, [&](double depth) {
               const double slices = (depth - sorted.front()) / gap;
               return std::abs(slices - std::round(slices)) < kMostUneven;
             });
    };
    if (!fits(spacing_mm) && std::isfinite(least_mm)) spacing_mm = least_mm;
    if (!fits(spacing_mm)) throw SegFault{.what = "has frames at uneven distances"};
    const double slices = std::round((sorted.back() - sorted.front()) / spacing_mm) + 1.0;
    if (!(slices <= imaging::kLargestScanAxis)) throw SegFault{.what = "has frames too far from each other"};
    header_.dims[2] = static_cast<std::int32_t>(slices);
    for (std::size_t i = 0; i < frames_.size(); ++i)
      frames_[i].slice = static_cast<int>(std::lround((depths_mm[i] - sorted.front()) / spacing_mm));
    const Vec3 origin = first + sorted.front() * normal;
    header_.origin_mm = {origin.x(), origin.y(), origin.z()};
  }

  void check_pixels() {
    const gdcm::Tag tag(0x7fe0, 0x0010);
    const gdcm::ByteValue* bytes = data_.FindDataElement(tag) ? data_.GetDataElement(tag).GetByteValue() : nullptr;
    const std::size_t bits =
        frames_.size() * static_cast<std::size_t>(header_.dims[0]) * static_cast<std::size_t>(header_.dims[1]);
    if (bytes == nullptr || bytes->GetPointer() == nullptr || bytes->GetLength() < (bits + 7) / 8)
      throw SegFault{.what = "is cut off within its pixel data"};
    pixels_ = bytes->GetPointer();
  }

  const gdcm::DataSet& data_;
  const gdcm::File& file_;
  DicomSegmentation header_;
  std::vector<SegFrame> frames_;
  const char* pixels_ = nullptr;
};

}  // namespace

Result<void> read_segmentation(
    const fs::path& file, const std::string& name, const std::function<void(const DicomSegmentation&)>& on_header,
    const std::function<void(std::size_t, const std::vector<imaging::VoxelRun>&)>& on_frame) try {
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.Read()) return bad_input(name + " is truncated or damaged; copy or export it again");
  const Segmentation segmentation(reader.GetFile());
  on_header(segmentation.header());
  for (std::size_t frame = 0; frame < segmentation.frames(); ++frame)
    on_frame(segmentation.segment(frame), segmentation.runs(frame));
  return {};
} catch (const SegFault& fault) {
  const bool has_remedy = fault.what.find(';') != std::string::npos;
  return failure(fault.code,
                 name + " " + fault.what + (has_remedy ? "" : "; export it again, or as NIfTI or .seg.nrrd"));
} catch (const std::bad_alloc&) {
  throw;  // the reader's process ends, as on any damaged file
} catch (const std::exception&) {
  return bad_input(name + " cannot be read; copy or export it again");
}

}  // namespace osteon::import
