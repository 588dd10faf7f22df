#include "server/import/volume_file.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadLength = 1024;
constexpr std::size_t kMostHeader = std::size_t{1} << 20;
constexpr double kAir_hu = -1024.0;

std::string unpacked_head(const fs::path& file) {
  const std::unique_ptr<archive, decltype(&archive_read_free)> a(archive_read_new(), archive_read_free);
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_raw(a.get());
  archive_entry* entry = nullptr;
  if (archive_read_open_filename(a.get(), file.c_str(), kHeadLength) != ARCHIVE_OK) return {};
  if (archive_read_next_header(a.get(), &entry) != ARCHIVE_OK) return {};
  std::string head(kHeadLength, '\0');
  const auto n = archive_read_data(a.get(), head.data(), head.size());
  head.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return head;
}

std::string first_bytes(const fs::path& file) {
  std::string head(kHeadLength, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head.starts_with("\x1f\x8b") ? unpacked_head(file) : head;
}

// How many bytes follow in a stream, unpacked. Stops counting at `most`.
std::uint64_t count_unpacked(int descriptor, std::uint64_t most) {
  const std::unique_ptr<archive, decltype(&archive_read_free)> a(archive_read_new(), archive_read_free);
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_raw(a.get());
  archive_entry* entry = nullptr;
  std::uint64_t count = 0;
  std::vector<char> bytes(std::size_t{1} << 20);
  if (archive_read_open_fd(a.get(), descriptor, bytes.size()) != ARCHIVE_OK ||
      archive_read_next_header(a.get(), &entry) != ARCHIVE_OK)
    return 0;
  while (count < most) {
    const auto n = archive_read_data(a.get(), bytes.data(), bytes.size());
    if (n <= 0) break;
    count += static_cast<std::uint64_t>(n);
  }
  return count;
}

// The text header of NRRD or MetaImage, with the line that ends it; empty if there is no end.
std::string text_header(const fs::path& file, VolumeFormat format) {
  std::ifstream in(file, std::ios::binary);
  std::string header;
  for (std::string line; header.size() < kMostHeader && std::getline(in, line);) {
    header += line + "\n";
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (format == VolumeFormat::nrrd ? line.empty() : line.starts_with("ElementDataFile")) return header;
  }
  return {};
}

// Where the voxels of a NIfTI file begin, and the bits of each, which ITK does not tell: it gives scaled ones as float.
struct NiftiVoxels {
  std::uint64_t start = 0, bits = 0;
};
// Nothing if the voxels are in another file.
std::optional<NiftiVoxels> nifti_voxels(const std::string& head) {
  const bool second = head.compare(4, 3, "n+2") == 0;
  if (head.size() < 348 || (!second && head.compare(344, 3, "n+1") != 0)) return std::nullopt;
  std::uint16_t bits = 0;
  std::memcpy(&bits, head.data() + (second ? 14 : 72), sizeof bits);
  if (bits > 256) bits = static_cast<std::uint16_t>(bits << 8 | bits >> 8);  // of a computer with the other order
  float start = 0.0f;
  std::int64_t start_2 = 0;
  std::memcpy(&start, head.data() + 108, sizeof start);
  std::memcpy(&start_2, head.data() + 168, sizeof start_2);
  const auto told = second ? static_cast<double>(start_2) : static_cast<double>(start);
  const double least = second ? 544.0 : 352.0;  // a header and four bytes; an offset in the other order makes no sense
  return NiftiVoxels{static_cast<std::uint64_t>(told >= least && told < 1e9 ? told : least), bits};
}

// The libraries take a file that ends within its voxels for a whole one, and the rest for zeros. `bytes`: of all
// voxels. What lies in other files is not checked.
bool ends_early(const fs::path& file, VolumeFormat format, std::uint64_t voxels, std::uint64_t bytes) {
  std::error_code error;
  const std::uint64_t file_bytes = fs::file_size(file, error);
  std::uint64_t start = 0;
  bool packed = false;
  if (format == VolumeFormat::nifti) {
    const std::optional<NiftiVoxels> nifti = nifti_voxels(first_bytes(file));
    if (!nifti) return false;
    bytes = nifti->start + voxels * nifti->bits / 8;
    packed = file.string().ends_with(".gz");
  } else {
    const std::string header = text_header(file, format);
    const bool nrrd = format == VolumeFormat::nrrd;
    const auto has = [&](std::string_view text) { return header.find(text) != std::string::npos; };
    if (header.empty()) return true;
    if (nrrd ? has("data file:") || has("datafile:") : !has("ElementDataFile = LOCAL")) return false;
    start = header.size();
    packed = nrrd && (has("encoding: gz") || has("encoding:gz"));
    if (nrrd && !packed && !has("encoding: raw")) return false;  // text or bzip2
    if (const std::size_t at = header.find("CompressedDataSize = "); !nrrd && has("CompressedData = True"))
      bytes = at == std::string::npos ? 0 : std::strtoull(header.c_str() + at + 21, nullptr, 10);
  }
  if (!packed) return file_bytes < start + bytes;
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return true;
  const bool early =
      ::lseek(descriptor, static_cast<off_t>(start), SEEK_SET) < 0 || count_unpacked(descriptor, bytes) < bytes;
  ::close(descriptor);
  return early;
}

itk::ImageIOBase::Pointer reader_of(const fs::path& file, VolumeFormat format) {
  itk::ImageIOBase::Pointer io;
  if (format == VolumeFormat::nifti)
    io = itk::NiftiImageIO::New();
  else if (format == VolumeFormat::nrrd)
    io = itk::NrrdImageIO::New();
  else
    io = itk::MetaImageIO::New();
  io->SetFileName(file.string());
  io->ReadImageInformation();
  return io;
}

std::int16_t to_hu(double value) {
  constexpr double least = std::numeric_limits<std::int16_t>::min(), most = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::int16_t>(std::lround(std::isnan(value) ? kAir_hu : std::clamp(value, least, most)));
}

template <class T>
void convert(const char* from, std::span<std::int16_t> to) {
  for (std::int16_t& hu : to) {
    T value;
    std::memcpy(&value, from, sizeof(T));
    hu = to_hu(static_cast<double>(value));
    from += sizeof(T);
  }
}

// Null for a type that is no number.
auto converter(itk::IOComponentEnum type) -> void (*)(const char*, std::span<std::int16_t>) {
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return convert<unsigned char>;
    case itk::IOComponentEnum::CHAR:
      return convert<signed char>;
    case itk::IOComponentEnum::USHORT:
      return convert<unsigned short>;
    case itk::IOComponentEnum::SHORT:
      return convert<short>;
    case itk::IOComponentEnum::UINT:
      return convert<unsigned>;
    case itk::IOComponentEnum::INT:
      return convert<int>;
    case itk::IOComponentEnum::ULONG:
      return convert<unsigned long>;
    case itk::IOComponentEnum::LONG:
      return convert<long>;
    case itk::IOComponentEnum::ULONGLONG:
      return convert<unsigned long long>;
    case itk::IOComponentEnum::LONGLONG:
      return convert<long long>;
    case itk::IOComponentEnum::FLOAT:
      return convert<float>;
    case itk::IOComponentEnum::DOUBLE:
      return convert<double>;
    default:
      return nullptr;
  }
}

// ITK's own sentences name its source files. A person needs to know what is wrong with the file.
tl::unexpected<Error> damaged(const fs::path& file) {
  return bad_input(file.string() + " is truncated or damaged; copy or export it again");
}

}  // namespace

VolumeFormat volume_format(const fs::path& file) {
  const std::string head = first_bytes(file);
  const auto has = [&](std::size_t at, std::string_view mark) {
    return head.size() >= at + mark.size() && std::string_view(head).substr(at, mark.size()) == mark;
  };
  for (const std::string_view mark : {"n+1", "ni1"})
    if (has(344, mark)) return VolumeFormat::nifti;
  for (const std::string_view mark : {"n+2", "ni2"})
    if (has(4, mark)) return VolumeFormat::nifti;
  if (has(0, "NRRD000")) return VolumeFormat::nrrd;
  return has(0, "ObjectType") || has(0, "NDims") ? VolumeFormat::meta_image : VolumeFormat::none;
}

std::string_view name_of(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::nifti:
      return "NIfTI";
    case VolumeFormat::nrrd:
      return "NRRD";
    case VolumeFormat::meta_image:
      return "MetaImage";
    case VolumeFormat::none:
      break;
  }
  return "";
}

FileEndings endings_of(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::nifti:
      return {".nii", ".nii.gz", ".hdr"};
    case VolumeFormat::nrrd:
      return {".nrrd", ".nrrd", ".nhdr"};
    case VolumeFormat::meta_image:
      return {".mha", ".mha", ".mhd"};
    case VolumeFormat::none:
      break;
  }
  return {};
}

Result<VolumeHeader> read_volume_header(const fs::path& file, VolumeFormat format) try {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  // A dimension of one step is no obstacle.
  for (unsigned d = 3; d < io->GetNumberOfDimensions(); ++d)
    if (io->GetDimensions(d) > 1)
      return failure(ErrorCode::unsupported, file.string() + " has " + std::to_string(io->GetDimensions(d)) +
                                                 " volumes; give a file with one of them");
  if (io->GetNumberOfDimensions() < 3) return bad_input(file.string() + " has one slice; give a scan with several");
  if (io->GetNumberOfComponents() != 1 || converter(io->GetComponentType()) == nullptr)
    return failure(ErrorCode::unsupported,
                   file.string() + " has colours or vectors; give a CT, with one number for each voxel");
  VolumeHeader header;
  header.voxel_bytes = io->GetComponentSize();
  for (unsigned d = 0; d < 3; ++d) {
    header.dims[d] = io->GetDimensions(d);
    header.spacing_mm[d] = io->GetSpacing(d);
    header.origin_mm[d] = io->GetOrigin(d);
    std::ranges::copy_n(io->GetDirection(d).begin(), 3, header.axes[d].begin());
  }
  return header;
} catch (const itk::ExceptionObject&) {
  return damaged(file);
}

Result<void> read_volume_slices(const fs::path& file, VolumeFormat format,
                                const std::function<void(std::span<const std::int16_t>)>& on_slice) try {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  const auto to_slice = converter(io->GetComponentType());
  if (io->GetNumberOfDimensions() < 3 || to_slice == nullptr) return damaged(file);
  itk::ImageIORegion all(io->GetNumberOfDimensions());
  for (unsigned d = 0; d < io->GetNumberOfDimensions(); ++d) all.SetSize(d, io->GetDimensions(d));
  io->SetIORegion(all);
  if (ends_early(file, format, static_cast<std::uint64_t>(io->GetImageSizeInPixels()),
                 static_cast<std::uint64_t>(io->GetImageSizeInBytes())))
    return damaged(file);
  std::vector<char> voxels(static_cast<std::size_t>(io->GetImageSizeInBytes()));
  io->Read(voxels.data());
  std::vector<std::int16_t> slice(io->GetDimensions(0) * io->GetDimensions(1));
  const std::size_t slice_bytes = slice.size() * io->GetComponentSize();
  for (std::size_t s = 0; s < io->GetDimensions(2); ++s) {
    to_slice(voxels.data() + s * slice_bytes, slice);
    on_slice(slice);
  }
  return {};
} catch (const itk::ExceptionObject&) {
  return damaged(file);
}

}  // namespace osteon::import
