#include "server/import/dicom_header.hpp"

#include <fcntl.h>
#include <gdcmReader.h>
#include <gdcmStringFilter.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <optional>

#include "server/import/dicom_frames.hpp"
#include "server/import/dicom_text.hpp"
#include "server/import/found_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

const gdcm::Tag kPixelData(0x7fe0, 0x0010);
constexpr std::uint32_t kLongestValue = 4096;
constexpr std::size_t kShownLetters = 64;

// SOP classes that are not images of a modality, by the beginning of their UID below 1.2.840.10008. The first match
// counts.
struct SopClass {
  std::string_view uid;
  FileKind kind;
};
constexpr SopClass kSopClasses[] = {
    {"1.3.10", FileKind::index},
    {"5.1.4.1.1.88.67", FileKind::dose_report},  // X-ray
    {"5.1.4.1.1.88.68", FileKind::dose_report},  // radiopharmaceutical
    {"5.1.4.1.1.88.73", FileKind::dose_report},  // of the patient
    {"5.1.4.1.1.88.74", FileKind::dose_report},
    {"5.1.4.1.1.88.76", FileKind::dose_report},  // enhanced X-ray
    {"5.1.4.1.1.88", FileKind::report},
    {"5.1.4.1.1.7", FileKind::secondary_capture},
    {"5.1.4.1.1.11", FileKind::presentation},
    {"5.1.4.1.1.66.4", FileKind::segmentation},
    {"5.1.4.1.1.66.5", FileKind::segmentation},  // of surfaces
    {"5.1.4.1.1.66.1", FileKind::registration},
    {"5.1.4.1.1.66.2", FileKind::registration},  // fiducials
    {"5.1.4.1.1.66.3", FileKind::registration},  // deformable
    {"5.1.4.1.1.66", FileKind::raw_data},
    {"5.1.4.1.1.104", FileKind::document},
    {"5.1.4.1.1.481", FileKind::radiotherapy},
};
constexpr std::string_view kDicomRoot = "1.2.840.10008.";
constexpr std::string_view kCtImage = "1.2.840.10008.5.1.4.1.1.2";  // also enhanced and converted ones, below it

struct Modality {
  std::string_view name;
  FileKind kind;
};
constexpr Modality kModalities[] = {
    {"SEG", FileKind::segmentation},    {"SR", FileKind::report},           {"PR", FileKind::presentation},
    {"REG", FileKind::registration},    {"DOC", FileKind::document},        {"RTSTRUCT", FileKind::radiotherapy},
    {"RTPLAN", FileKind::radiotherapy}, {"RTDOSE", FileKind::radiotherapy}, {"KO", FileKind::report}};

// Transfer syntaxes by the end of their UID below 1.2.840.10008.1.2.
struct Syntax {
  std::string_view uid;
  Compression compression;
};
constexpr Syntax kSyntaxes[] = {
    {"", Compression::lossless},       // implicit, little endian
    {".1", Compression::lossless},     // explicit, little endian
    {".1.99", Compression::lossless},  // deflated
    {".2", Compression::lossless},     // explicit, big endian
    {".4.50", Compression::lossy},     // JPEG, 8 bits
    {".4.51", Compression::lossy},     // JPEG, 12 bits
    {".4.57", Compression::lossless},  // JPEG lossless, any predictor
    {".4.70", Compression::lossless},  // JPEG lossless, first predictor
    {".4.80", Compression::lossless},  // JPEG-LS
    {".4.81", Compression::lossy},     // JPEG-LS, nearly lossless
    {".4.90", Compression::lossless},  // JPEG 2000
    {".4.91", Compression::lossy},     // JPEG 2000, with or without loss
    {".5", Compression::lossless},     // run lengths
    {".4.53", Compression::retired},   // JPEG, spectral selection
    {".4.55", Compression::retired},   // JPEG, progressive
};
constexpr std::string_view kSyntaxRoot = "1.2.840.10008.1.2";
constexpr std::string_view kPrivateSyntaxes[] = {"1.2.840.113619.5.2", "1.3.46.670589.33.1.4.1"};  // not compressed

bool is_below(std::string_view uid, std::string_view root) {
  return uid.starts_with(root) && (uid.size() == root.size() || uid[root.size()] == '.');
}

bool has_word(std::string_view values, std::string_view word) {
  while (!values.empty()) {
    const std::size_t end = std::min(values.find('\\'), values.size());
    std::string_view value = values.substr(0, end);
    while (value.ends_with(' ')) value.remove_suffix(1);
    while (value.starts_with(' ')) value.remove_prefix(1);
    if (value == word) return true;
    values.remove_prefix(std::min(end + 1, values.size()));
  }
  return false;
}

// Values as text. Values longer than any that is needed are omitted.
class Values {
 public:
  explicit Values(const gdcm::File& file) : data_(file.GetDataSet()) { filter_.SetFile(file); }
  [[nodiscard]] std::string text(std::uint16_t group, std::uint16_t element) const {
    const gdcm::Tag tag(group, element);
    if (!data_.FindDataElement(tag)) return {};
    const gdcm::ByteValue* bytes = data_.GetDataElement(tag).GetByteValue();
    if (bytes == nullptr || bytes->GetLength() > kLongestValue) return {};
    return trimmed(filter_.ToString(tag));
  }

 private:
  const gdcm::DataSet& data_;
  mutable gdcm::StringFilter filter_;
};

std::string meta_text(const gdcm::File& file, const gdcm::Tag& tag) {
  const gdcm::FileMetaInformation& meta = file.GetHeader();
  if (!meta.FindDataElement(tag)) return {};
  const gdcm::ByteValue* bytes = meta.GetDataElement(tag).GetByteValue();
  return bytes == nullptr || bytes->GetLength() > kLongestValue
             ? std::string()
             : trimmed(std::string(bytes->GetPointer(), bytes->GetLength()));
}

// Reads everything before the pixels, and their offset if there are any. False if the file cannot be read that far.
bool read_before_pixels(gdcm::Reader& reader, const fs::path& file, DicomHeader& h) {
  reader.SetFileName(file.c_str());
  if (!reader.ReadUpToTag(kPixelData, {kPixelData})) return false;
  // The reader stops after the element's header, or else at the end of the file.
  h.pixel_offset = reader.GetStreamCurrentPosition();
  if (h.pixel_offset >= h.bytes) h.pixel_offset = 0;
  return true;
}

void read_slice(const Values& values, const gdcm::File& file, DicomHeader& h) {
  const auto text = [&](std::uint16_t group, std::uint16_t element) { return values.text(group, element); };
  h.series = text(0x0020, 0x000e);
  h.instance = text(0x0008, 0x0018);
  h.frame_of_reference = text(0x0020, 0x0052);
  if (const char* syntax = file.GetHeader().GetDataSetTransferSyntax().GetString()) h.transfer_syntax = trimmed(syntax);
  h.compression = compression_of(h.transfer_syntax, text(0x0028, 0x2110));
  const bool latin1 = text(0x0008, 0x0005).find("100") != std::string::npos;
  h.description = shown_text(text(0x0008, 0x103e), kShownLetters, latin1);
  h.kernel = shown_text(text(0x0018, 0x1210), kShownLetters, latin1);
  std::ranges::replace(h.kernel, '\\', '/');  // several values
  h.series_number = integer(text(0x0020, 0x0011), 0);
  h.acquisition = integer(text(0x0020, 0x0012), 0);
  h.temporal_position = integer(text(0x0020, 0x0100), 0);
  h.frames = integer(text(0x0028, 0x0008), 1);
  h.rows = integer(text(0x0028, 0x0010), 0);
  h.columns = integer(text(0x0028, 0x0011), 0);
  h.samples = integer(text(0x0028, 0x0002), 1);
  h.photometric = shown_text(text(0x0028, 0x0004), kShownLetters);
  h.bits_allocated = integer(text(0x0028, 0x0100), 0);
  h.bits_stored = integer(text(0x0028, 0x0101), h.bits_allocated);
  h.position = near(numbers(text(0x0020, 0x0032)));
  h.orientation = numbers(text(0x0020, 0x0037));
  h.spacing = near(numbers(text(0x0028, 0x0030)));
  h.intercept = numbers(text(0x0028, 0x1052));
  h.slope = numbers(text(0x0028, 0x1053));
  h.padding = numbers(text(0x0028, 0x0120));
}

// Other programs write whole CT volumes as secondary captures. Pictures of a screen have no position in the patient.
bool is_placed(const DicomHeader& h) {
  return h.position.size() == 3 && h.orientation.size() == 6 && h.spacing.size() == 2 && h.slope.size() == 1 &&
         h.intercept.size() == 1 && h.samples == 1;
}

// Adds what the functional groups of an enhanced image say of each frame.
void read_dicom(const fs::path& file, DicomHeader& h, std::vector<DicomHeader>& frames) {
  gdcm::Reader reader;
  const bool whole = read_before_pixels(reader, file, h);
  const Values values(reader.GetFile());
  std::string sop_class = values.text(0x0008, 0x0016);
  if (sop_class.empty()) sop_class = meta_text(reader.GetFile(), gdcm::Tag(0x0002, 0x0002));
  h.modality = shown_text(values.text(0x0008, 0x0060), 16);
  h.image_type = values.text(0x0008, 0x0008);
  h.kind = kind_of(sop_class, h.modality, h.image_type);
  if (!whole) {
    // A file that is not CT is reported by its kind, whether or not it can be read.
    const bool unknown = h.kind == FileKind::ct_slice || (h.kind == FileKind::other_modality && h.modality.empty());
    const std::string syntax = meta_text(reader.GetFile(), gdcm::Tag(0x0002, 0x0010));
    const bool known = syntax.empty() || compression_of(syntax, {}) != Compression::unknown;
    if (unknown) h.kind = known ? FileKind::damaged : FileKind::unknown_syntax;
    return;
  }
  if (h.kind != FileKind::ct_slice && (h.kind != FileKind::secondary_capture || h.modality != "CT")) return;
  read_slice(values, reader.GetFile(), h);
  if (h.kind == FileKind::secondary_capture && !is_placed(h)) return;
  h.kind = FileKind::ct_slice;
  bool has_pixels = h.pixel_offset > 0;
  // In a deflated file the position in the stream has no meaning.
  if (reader.GetFile().GetHeader().GetDataSetTransferSyntax() == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian) {
    gdcm::Reader all;
    all.SetFileName(file.c_str());
    h.pixel_offset = 0;
    if (!all.ReadUpToTag(kPixelData)) h.kind = FileKind::damaged;
    has_pixels = all.GetFile().GetDataSet().FindDataElement(kPixelData);
  }
  if (!has_pixels && h.kind == FileKind::ct_slice) h.kind = FileKind::no_pixels;
  if (h.kind == FileKind::ct_slice) frames = frames_of(h, reader.GetFile());
}

}  // namespace

void DicomHeader::pack(ByteWriter& to) const {
  to.add(file), to.add(bytes), to.add(pixel_offset), to.add(kind), to.add(modality), to.add(compression);
  to.add(series), to.add(instance), to.add(transfer_syntax), to.add(photometric), to.add(image_type),
      to.add(frame_of_reference), to.add(description), to.add(kernel);
  to.add(series_number), to.add(acquisition), to.add(temporal_position), to.add(frames), to.add(frame), to.add(is_hu),
      to.add(columns), to.add(rows);
  to.add(bits_allocated), to.add(bits_stored), to.add(samples);
  to.add(position), to.add(orientation), to.add(spacing), to.add(slope), to.add(intercept), to.add(padding);
}

bool DicomHeader::unpack(ByteReader& from) {
  return from.get(file) && from.get(bytes) && from.get(pixel_offset) && from.get(kind) && kind <= FileKind::too_deep &&
         from.get(modality) && from.get(compression) && compression <= Compression::unknown && from.get(series) &&
         from.get(instance) && from.get(transfer_syntax) && from.get(photometric) && from.get(image_type) &&
         from.get(frame_of_reference) && from.get(description) && from.get(kernel) && from.get(series_number) &&
         from.get(acquisition) && from.get(temporal_position) && from.get(frames) && from.get(frame) &&
         from.get(is_hu) && from.get(columns) && from.get(rows) && from.get(bits_allocated) && from.get(bits_stored) &&
         from.get(samples) && from.get(position) && from.get(orientation) && from.get(spacing) && from.get(slope) &&
         from.get(intercept) && from.get(padding);
}

Compression compression_of(std::string_view transfer_syntax, std::string_view said_lossy) {
  const bool is_standard = transfer_syntax.starts_with(kSyntaxRoot);
  Compression compression = Compression::unknown;
  if (is_standard) {
    const auto found = std::ranges::find(kSyntaxes, transfer_syntax.substr(kSyntaxRoot.size()), &Syntax::uid);
    if (found != std::end(kSyntaxes)) compression = found->compression;
  } else if (transfer_syntax.empty() ||
             std::ranges::find(kPrivateSyntaxes, transfer_syntax) != std::end(kPrivateSyntaxes)) {
    compression = Compression::lossless;
  }
  if (compression == Compression::lossless && said_lossy == "01") return Compression::lossy;
  const bool is_either = transfer_syntax == "1.2.840.10008.1.2.4.91";
  return is_either && said_lossy == "00" ? Compression::lossless : compression;
}

FileKind kind_of(std::string_view sop_class, std::string_view modality, std::string_view image_type) {
  if (sop_class.starts_with(kDicomRoot)) {
    const auto found = std::ranges::find_if(
        kSopClasses, [&](const SopClass& c) { return is_below(sop_class.substr(kDicomRoot.size()), c.uid); });
    const bool dose_picture = found != std::end(kSopClasses) && found->kind == FileKind::secondary_capture &&
                              image_type.find("DOSE") != std::string_view::npos;
    if (dose_picture) return FileKind::dose_report;
    if (found != std::end(kSopClasses)) return found->kind;
  }
  const auto named = std::ranges::find(kModalities, modality, &Modality::name);
  if (named != std::end(kModalities)) return named->kind;
  if (modality != "CT" && !(modality.empty() && is_below(sop_class, kCtImage))) return FileKind::other_modality;
  if (has_word(image_type, "LOCALIZER") || has_word(image_type, "SCOUT")) return FileKind::localizer;
  return FileKind::ct_slice;
}

std::vector<DicomHeader> read_headers(const fs::path& file) {
  DicomHeader h;
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  std::array<unsigned char, kHeadBytes> bytes{};
  const bool opened = descriptor >= 0 && ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  const ssize_t got = opened ? ::pread(descriptor, bytes.data(), bytes.size(), 0) : -1;
  if (descriptor >= 0) ::close(descriptor);
  h.kind = FileKind::unreadable;
  if (got < 0) return {h};
  h.bytes = static_cast<std::uint64_t>(status.st_size);
  switch (content_of({bytes.data(), static_cast<std::size_t>(got)})) {
    case Content::empty:
      h.kind = FileKind::empty;
      return {h};
    case Content::archive:
      h.kind = FileKind::archive;
      return {h};
    case Content::other:
      h.kind = FileKind::not_dicom;
      return {h};
    case Content::dicom:
      break;
  }
  std::vector<DicomHeader> frames;
  try {
    read_dicom(file, h, frames);
  } catch (const std::bad_alloc&) {
    h.kind = FileKind::damaged;
  } catch (const std::exception&) {
    h.kind = FileKind::damaged;
  }
  if (frames.empty()) frames.push_back(std::move(h));
  return frames;
}

}  // namespace osteon::import
