#include "server/import/dicom_reader.hpp"

#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmStringFilter.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/import/isolated_reader.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

const gdcm::Tag kPixelData(0x7fe0, 0x0010);

// What a file's header says, before its pixels are read.
struct Header {
  fs::path file;
  std::string modality;
  std::string series;
  std::string transfer_syntax;
  bool localizer = false;
  int frames = 1;
  int columns = 0, rows = 0;
  int bits_allocated = 0, bits_stored = 0, samples = 1;
  bool is_signed = false;
  std::string photometric;
  std::vector<double> position, orientation, spacing, slope, intercept;
  double along_mm = 0.0;  // position along the normal
};

std::string trimmed(std::string text) {
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && is_padding(text.back())) text.pop_back();
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), is_padding));
  return text;
}

// "1.0\0.0": values separated by backslashes; empty where any is not a finite number.
std::vector<double> numbers(const std::string& text) {
  std::vector<double> values;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\\', begin), text.size());
    const std::string part = trimmed(text.substr(begin, end - begin));
    char* stop = nullptr;
    const double value = std::strtod(part.c_str(), &stop);
    if (part.empty() || *stop != '\0' || !std::isfinite(value)) return {};
    values.push_back(value);
    begin = end + 1;
  }
  return values;
}

int integer(const std::string& text, int otherwise) {
  const auto values = numbers(text);
  return values.empty() ? otherwise : static_cast<int>(values.front());
}

// Nothing where the file is not DICOM at all.
Result<std::optional<Header>> read_header(const fs::path& file) {
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.CanRead()) return std::optional<Header>{};
  if (!reader.ReadUpToTag(kPixelData, {}))
    return failure(ErrorCode::invalid_input, file.string() + " looks like DICOM but cannot be read; it is damaged, copy or export it again");
  gdcm::StringFilter tags;
  tags.SetFile(reader.GetFile());
  const auto text = [&](std::uint16_t group, std::uint16_t element) { return trimmed(tags.ToString(gdcm::Tag(group, element))); };
  Header h;
  h.file = file;
  h.modality = text(0x0008, 0x0060);
  h.series = text(0x0020, 0x000e);
  if (const char* syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax().GetString()) h.transfer_syntax = trimmed(syntax);
  h.localizer = text(0x0008, 0x0008).find("LOCALIZER") != std::string::npos;
  h.frames = integer(text(0x0028, 0x0008), 1);
  h.rows = integer(text(0x0028, 0x0010), 0);
  h.columns = integer(text(0x0028, 0x0011), 0);
  h.samples = integer(text(0x0028, 0x0002), 1);
  h.photometric = text(0x0028, 0x0004);
  h.bits_allocated = integer(text(0x0028, 0x0100), 0);
  h.bits_stored = integer(text(0x0028, 0x0101), h.bits_allocated);
  h.is_signed = integer(text(0x0028, 0x0103), 0) == 1;
  h.position = numbers(text(0x0020, 0x0032));
  h.orientation = numbers(text(0x0020, 0x0037));
  h.spacing = numbers(text(0x0028, 0x0030));
  h.intercept = numbers(text(0x0028, 0x1052));
  h.slope = numbers(text(0x0028, 0x1053));
  return std::optional<Header>(std::move(h));
}

Result<std::vector<Header>> read_headers(const fs::path& folder, const AtFile& at_file, const KeepGoing& keep_going) {
  std::vector<fs::path> files;
  bool subfolders = false;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    subfolders = subfolders || entry->is_directory(error);
    if (entry->is_regular_file(error)) files.push_back(entry->path());
  }
  if (error) return failure(ErrorCode::not_found, "cannot list " + folder.string() + ": " + error.message());
  const std::string inner = subfolders ? "; its subfolders are not searched, give the one with the series" : "; give the folder with the CT series";
  if (files.empty()) return failure(ErrorCode::invalid_input, folder.string() + (subfolders ? " holds no files" : " is empty") + inner);
  std::ranges::sort(files);

  std::vector<Header> headers;
  for (const fs::path& file : files) {
    if (!keep_going(0.0)) return failure(ErrorCode::cancelled, "stopped while reading " + folder.string());
    at_file(file);
    auto header = read_header(file);
    if (!header) return tl::unexpected(header.error());
    if (*header) headers.push_back(std::move(**header));
  }
  if (headers.empty()) return failure(ErrorCode::invalid_input, folder.string() + " holds no DICOM files" + inner);
  return headers;
}

// The one CT series of the folder, without scout images.
Result<std::vector<Header>> one_ct_series(std::vector<Header> headers, const fs::path& folder) {
  const bool scouts_only = std::ranges::all_of(headers, &Header::localizer);
  if (scouts_only)
    return failure(ErrorCode::invalid_input, folder.string() + " holds only scout images (LOCALIZER); give the folder with the CT series");
  std::erase_if(headers, [](const Header& h) { return h.localizer; });

  std::map<std::string, std::pair<std::string, int>> series;  // uid: modality, files
  for (const Header& h : headers) {
    auto& [modality, files] = series[h.series];
    modality = h.modality;
    ++files;
  }
  if (series.size() > 1) {
    std::string list;
    for (const auto& [uid, content] : series)
      list += (list.empty() ? "" : ", ") + (content.first.empty() ? "unknown" : content.first) + " with " + std::to_string(content.second) +
              (content.second == 1 ? " file" : " files");
    return failure(ErrorCode::invalid_input, folder.string() + " holds " + std::to_string(series.size()) + " series (" + list +
                                                 "); put the one to import into a folder of its own");
  }
  for (const Header& h : headers)
    if (h.modality != "CT")
      return failure(ErrorCode::unsupported, h.file.string() + " is " + (h.modality.empty() ? "of unknown modality" : h.modality) +
                                                 ", not CT; only CT has the Hounsfield units that an import needs");
  return headers;
}

// Checks one file alone; what it lacks is named as DICOM names it.
Result<void> check_header(const Header& h) {
  const auto lacks = [&](const std::string& what) {
    return failure(ErrorCode::invalid_input, h.file.string() + " has no valid " + what + "; export the series again as original CT slices");
  };
  const auto cannot = [&](const std::string& what) { return failure(ErrorCode::unsupported, h.file.string() + " " + what); };
  if (h.frames > 1) return cannot("holds " + std::to_string(h.frames) + " frames; export the series with one file for each slice");
  if (h.columns < 2 || h.rows < 2) return lacks("Rows and Columns (0028,0010-0011)");
  if (h.samples != 1 || h.photometric != "MONOCHROME2") return cannot("has colours (" + h.photometric + ") instead of Hounsfield units; export original CT slices");
  if (h.bits_allocated != 8 && h.bits_allocated != 16)
    return cannot("stores " + std::to_string(h.bits_allocated) + " bits for a pixel; only 8 and 16 can be read");
  if (h.bits_stored < 1 || h.bits_stored > h.bits_allocated) return lacks("BitsStored (0028,0101)");
  if (h.spacing.size() != 2 || h.spacing[0] <= 0.0 || h.spacing[1] <= 0.0) return lacks("PixelSpacing (0028,0030)");
  if (h.position.size() != 3) return lacks("ImagePositionPatient (0020,0032)");
  if (h.orientation.size() != 6) return lacks("ImageOrientationPatient (0020,0037)");
  if (h.intercept.size() != 1 || h.slope.size() != 1 || h.slope[0] == 0.0) return lacks("RescaleSlope and RescaleIntercept (0028,1052-1053)");
  // Spectral selection and progression were retired from DICOM; decoders give noise without noticing.
  if (h.transfer_syntax == "1.2.840.10008.1.2.4.53" || h.transfer_syntax == "1.2.840.10008.1.2.4.55")
    return cannot("uses a retired JPEG compression (" + h.transfer_syntax + "); export the series uncompressed or lossless");
  return {};
}

Vec3 vec(const std::vector<double>& v, std::size_t first = 0) { return {v[first], v[first + 1], v[first + 2]}; }

// Grid and order of the slices; `headers` come out sorted along the normal.
Result<imaging::HuVolume> arrange(std::vector<Header>& headers, const fs::path& folder) {
  const Header& first = headers.front();
  imaging::HuVolume volume;
  const Vec3 across = vec(first.orientation).normalized();
  Vec3 down = vec(first.orientation, 3).normalized();
  if (!across.allFinite() || !down.allFinite() || std::abs(across.dot(down)) > 1e-3)
    return failure(ErrorCode::invalid_input, first.file.string() + ": ImageOrientationPatient (0020,0037) is not two perpendicular directions; export the series again");
  down = (down - across * across.dot(down)).normalized();
  const Vec3 normal = across.cross(down);

  for (Header& h : headers) {
    if (h.columns != first.columns || h.rows != first.rows)
      return failure(ErrorCode::invalid_input, folder.string() + ": " + h.file.filename().string() + " has another size than " +
                                                   first.file.filename().string() + "; put only the slices of one volume into the folder");
    const bool same_spacing = std::abs(h.spacing[0] - first.spacing[0]) < 1e-4 && std::abs(h.spacing[1] - first.spacing[1]) < 1e-4;
    const bool same_plane = (vec(h.orientation) - vec(first.orientation)).norm() < 1e-3 && (vec(h.orientation, 3) - vec(first.orientation, 3)).norm() < 1e-3;
    if (!same_spacing || !same_plane)
      return failure(ErrorCode::invalid_input, folder.string() + ": " + h.file.filename().string() + " has another " +
                                                   (same_spacing ? "orientation" : "pixel spacing") + " than " + first.file.filename().string() +
                                                   "; put only the slices of one volume into the folder");
    h.along_mm = normal.dot(vec(h.position));
  }
  if (headers.size() < 2)
    return failure(ErrorCode::invalid_input, folder.string() + " holds a single slice; a volume needs at least two");
  std::ranges::stable_sort(headers, {}, &Header::along_mm);

  const Vec3 origin = vec(headers.front().position);
  const double length_mm = headers.back().along_mm - headers.front().along_mm;
  const double step_mm = length_mm / static_cast<double>(headers.size() - 1);
  char text[160];

  // A tilted gantry moves the slices sideways within their plane: a sheared volume.
  const Vec3 travel = vec(headers.back().position) - origin;
  const double sideways_mm = (travel - normal * length_mm).norm();
  const double pixel_mm = std::min(first.spacing[0], first.spacing[1]);
  if (sideways_mm > 0.5 * pixel_mm) {
    std::snprintf(text, sizeof text, " is sheared by %.1f degrees (tilted gantry); export it resampled to upright slices",
                  std::atan2(sideways_mm, length_mm) * 180.0 / 3.14159265358979);
    return failure(ErrorCode::unsupported, folder.string() + text);
  }
  // One missing slice opens a gap of two steps; a position written with one decimal must pass.
  std::vector<double> gaps;
  for (std::size_t i = 1; i < headers.size(); ++i) gaps.push_back(headers[i].along_mm - headers[i - 1].along_mm);
  std::vector<double> sorted = gaps;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
  const double usual_mm = sorted[sorted.size() / 2];
  // The worst gap, or else the first slice that has drifted from where even steps would put it.
  std::size_t at = headers.size();
  double worst_mm = 0.2 * usual_mm;
  for (std::size_t i = 0; i < gaps.size(); ++i)
    if (std::abs(gaps[i] - usual_mm) > worst_mm || gaps[i] < 1e-3) {
      worst_mm = std::max(worst_mm, std::abs(gaps[i] - usual_mm));
      at = i;
    }
  for (std::size_t i = 0; at == headers.size() && i < gaps.size(); ++i)
    if (std::abs(headers[i + 1].along_mm - (headers.front().along_mm + static_cast<double>(i + 1) * step_mm)) > 0.1 * step_mm) at = i;
  if (at < headers.size()) {
    std::snprintf(text, sizeof text, " are %.3g mm apart where %.3g mm is usual; add the missing slices or remove the doubled ones", gaps[at], usual_mm);
    return failure(ErrorCode::invalid_input, folder.string() + ": the slices " + headers[at].file.filename().string() + " and " +
                                                 headers[at + 1].file.filename().string() + text);
  }

  volume.dims = {first.columns, first.rows, static_cast<int>(headers.size())};
  volume.spacing_mm = {first.spacing[1], first.spacing[0], step_mm};
  volume.origin_mm = origin;
  volume.directions << across, down, normal;
  return volume;
}

// One slice's HU into `out`.
Result<void> read_pixels(const Header& h, std::int16_t* out) {
  const auto broken = [&](const std::string& why) {
    return failure(ErrorCode::invalid_input, h.file.string() + " " + why + "; copy or export the series again");
  };
  gdcm::ImageReader reader;
  reader.SetFileName(h.file.c_str());
  const bool read = reader.Read();
  if (!reader.GetFile().GetDataSet().FindDataElement(kPixelData)) return broken("has no pixel data");
  if (!read) return broken("has pixel data that cannot be read");
  const gdcm::Image& image = reader.GetImage();
  const std::size_t pixels = static_cast<std::size_t>(h.columns) * static_cast<std::size_t>(h.rows);
  const std::size_t width = image.GetPixelFormat().GetBitsAllocated() / 8u;
  if ((width != 1 && width != 2) || image.GetBufferLength() != pixels * width) return broken("has pixel data of another size than its header says");
  // Some scanners write metal beyond the range that BitsStored promises. The library would cut those bits off and so
  // turn metal into air; plain pixels are therefore taken as they lie in the file.
  std::vector<char> buffer(image.GetBufferLength());
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  const gdcm::ByteValue* bytes = image.GetDataElement().GetByteValue();
  const bool plain = (syntax == gdcm::TransferSyntax::ImplicitVRLittleEndian || syntax == gdcm::TransferSyntax::ExplicitVRLittleEndian) &&
                     image.GetNumberOfOverlays() == 0 && bytes != nullptr && bytes->GetLength() >= buffer.size();
  if (plain) std::memcpy(buffer.data(), bytes->GetPointer(), buffer.size());
  else if (!image.GetBuffer(buffer.data())) return broken("has pixel data that cannot be decompressed");

  // Signed values may lack their sign in the bits above the stored ones.
  const bool is_signed = image.GetPixelFormat().GetPixelRepresentation() == 1;
  const int unused = is_signed ? 16 - static_cast<int>(image.GetPixelFormat().GetBitsStored()) : 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    std::uint16_t raw = static_cast<std::uint8_t>(buffer[i]);
    if (width == 2) std::memcpy(&raw, buffer.data() + 2 * i, 2);
    const int stored = is_signed ? static_cast<std::int16_t>(static_cast<std::uint16_t>(raw << unused)) >> unused : raw;
    const double hu = stored * h.slope[0] + h.intercept[0];
    out[i] = static_cast<std::int16_t>(std::lround(std::clamp(hu, -32768.0, 32767.0)));
  }
  return {};
}

Result<CtScan> read_series(const fs::path& folder, const AtFile& at_file, const KeepGoing& keep_going) try {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();

  auto found = read_headers(folder, at_file, keep_going);
  if (!found) return tl::unexpected(found.error());
  auto series = one_ct_series(std::move(*found), folder);
  if (!series) return tl::unexpected(series.error());
  for (const Header& h : *series)
    if (auto checked = check_header(h); !checked) return tl::unexpected(checked.error());
  auto volume = arrange(*series, folder);
  if (!volume) return tl::unexpected(volume.error());

  volume->values.resize(volume->count());
  for (std::size_t i = 0; i < series->size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(series->size())))
      return failure(ErrorCode::cancelled, "stopped while reading " + folder.string());
    at_file((*series)[i].file);
    if (auto read = read_pixels((*series)[i], volume->values.data() + volume->index(0, 0, static_cast<int>(i))); !read)
      return tl::unexpected(read.error());
  }
  CtScan scan{std::move(*volume), {}};
  scan.source = "DICOM CT, " + imaging::describe(scan.volume);
  return scan;
} catch (const std::exception& error) {
  return failure(ErrorCode::invalid_input, folder.string() + " cannot be read as DICOM: " + error.what());
}

}  // namespace

Result<CtScan> read_dicom_series(const fs::path& folder, const KeepGoing& keep_going) {
  // Debian builds GDCM with its assertions, which abort on some damaged files.
  return read_isolated([&](const AtFile& at_file, const KeepGoing& progress) { return read_series(folder, at_file, progress); }, keep_going);
}

}  // namespace osteon::import
