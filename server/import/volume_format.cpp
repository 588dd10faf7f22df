#include "server/import/volume_format.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "common/core/read_number.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadLength = 1024;
constexpr std::size_t kLongestHeader = std::size_t{1} << 20;  // of text
constexpr std::uint64_t kMostCompression = 1100;              // deflate makes one byte of at most 1032

using Archive = std::unique_ptr<archive, decltype(&archive_read_free)>;

// A stream that is compressed by gzip, or not. Null if it cannot be read.
Archive unpacking(int descriptor) {
  Archive a(archive_read_new(), archive_read_free);
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_raw(a.get());
  archive_entry* entry = nullptr;
  if (archive_read_open_fd(a.get(), descriptor, std::size_t{1} << 16) != ARCHIVE_OK ||
      archive_read_next_header(a.get(), &entry) != ARCHIVE_OK)
    a.reset();
  return a;
}

class OpenFile {
 public:
  explicit OpenFile(const fs::path& file) : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  [[nodiscard]] std::string unpacked_head(std::size_t bytes) const {
    const Archive a = unpacking(descriptor_);
    std::string head(bytes, '\0');
    const auto n = a ? archive_read_data(a.get(), head.data(), head.size()) : 0;
    head.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return head;
  }
  // True if that many bytes follow `start`, unpacked.
  [[nodiscard]] bool has_unpacked(std::uint64_t start, std::uint64_t bytes) const {
    if (::lseek(descriptor_, static_cast<off_t>(start), SEEK_SET) < 0) return false;
    const Archive a = unpacking(descriptor_);
    std::vector<char> part(std::size_t{1} << 20);
    std::uint64_t count = 0;
    while (a && count < bytes) {
      const auto n = archive_read_data(a.get(), part.data(), part.size());
      if (n <= 0) break;
      count += static_cast<std::uint64_t>(n);
    }
    return count >= bytes;
  }

 private:
  int descriptor_;
};

bool is_packed(const fs::path& file) {
  std::array<char, 2> mark{};
  std::ifstream(file, std::ios::binary).read(mark.data(), 2);
  return mark[0] == '\x1f' && mark[1] == '\x8b';
}

std::string first_bytes(const fs::path& file) { return unpacked_head(file, kHeadLength); }

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  T value{};
  if (bytes.size() >= at + sizeof value) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

bool has(const std::string& text, std::size_t at, std::string_view mark) {
  return text.size() >= at + mark.size() && std::string_view(text).substr(at, mark.size()) == mark;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The text header of NRRD or MetaImage.
class TextHeader {
 public:
  TextHeader(const fs::path& file, VolumeFormat format) {
    std::ifstream in(file, std::ios::binary);
    for (std::string line; !ended_ && length_ < kLongestHeader && std::getline(in, line);) {
      length_ += line.size() + 1;
      if (!line.empty() && line.back() == '\r') line.pop_back();
      ended_ = format == VolumeFormat::nrrd ? line.empty() : line.starts_with("ElementDataFile");
      lines_.push_back(line);
    }
    // The header of a detached NRRD may end with its file.
    ended_ = ended_ || (format == VolumeFormat::nrrd && in.eof());
  }

  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] std::uint64_t length() const { return length_; }
  // What stands behind `name` and a colon or an equals sign. Names differ in case and blanks between programs.
  [[nodiscard]] std::optional<std::string> field(std::string_view name) const {
    for (const std::string& line : lines_) {
      const std::size_t end = line.find_first_of(":=");
      if (end == std::string::npos) continue;
      std::string found = lower(line.substr(0, end));
      std::erase(found, ' ');
      const std::size_t from = line.find_first_not_of(' ', end + 1);
      if (found == name)
        return from == std::string::npos ? "" : line.substr(from, line.find_last_not_of(' ') - from + 1);
    }
    return std::nullopt;
  }

 private:
  std::vector<std::string> lines_;
  std::uint64_t length_ = 0;
  bool ended_ = false;
};

struct FileEndings {
  std::string_view plain, packed;
  std::string_view header;  // of a file whose voxels are in another file
};
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

// Where the voxels are stored.
struct Stored {
  fs::path file;
  std::uint64_t start = 0, bytes = 0;  // the bytes are counted unpacked if the file is packed
  bool packed = false;
};
using MaybeStored = std::optional<Stored>;  // nothing: stored in a way that is not checked

Stored stored_nifti(const fs::path& file, std::uint64_t voxels) {
  const std::string head = first_bytes(file);
  // ITK does not tell the bits of a stored voxel: it gives scaled ones as float.
  auto bits = number_at<std::uint16_t>(head, 72);
  if (bits > 256) bits = static_cast<std::uint16_t>(bits << 8 | bits >> 8);  // of a computer with the other order
  const std::uint64_t bytes = voxels * bits / 8;
  if (!has(head, 344, "n+1")) {
    fs::path data = fs::path(file).replace_extension(".img");
    std::error_code error;
    const bool packed = !fs::exists(data, error);
    if (packed) data += ".gz";
    return {data, 0, bytes, packed};
  }
  // A header and four bytes at least; an offset in the other order makes no sense.
  const float told = number_at<float>(head, 108);
  return {file, 0, (told >= 352.0f && told < 1e9f ? static_cast<std::uint64_t>(told) : 352) + bytes, is_packed(file)};
}

// Error: unsupported (several files).
Result<fs::path> named_file(const fs::path& file, const std::string& name) {
  if (name == "LIST" || name.starts_with("LIST ") || name.find('%') != std::string::npos)
    return failure(ErrorCode::unsupported, file.string() + " has its voxels in several files; save it as one file");
  return file.parent_path() / name;
}

Result<MaybeStored> stored_nrrd(const fs::path& file, std::uint64_t bytes) {
  const TextHeader header(file, VolumeFormat::nrrd);
  if (!header.ended()) return bad_input(file.string() + " is truncated; copy or export it again");
  const std::string encoding = lower(header.field("encoding").value_or(""));
  const bool packed = encoding == "gzip" || encoding == "gz";
  if (!packed && encoding != "raw") return MaybeStored();
  if (const auto name = header.field("datafile")) {
    const Result<fs::path> data = named_file(file, *name);
    if (!data) return tl::unexpected(data.error());
    return MaybeStored({*data, 0, bytes, packed});
  }
  return MaybeStored({file, header.length(), bytes, packed});
}

Result<MaybeStored> stored_meta_image(const fs::path& file, std::uint64_t bytes) {
  const TextHeader header(file, VolumeFormat::meta_image);
  if (!header.ended()) return bad_input(file.string() + " is truncated; copy or export it again");
  const std::string name = header.field("elementdatafile").value_or("");
  if (lower(header.field("compresseddata").value_or("")) == "true") {
    // The library reads zeros from such a file.
    const auto size = read_number<std::uint64_t>(header.field("compresseddatasize").value_or(""));
    if (!size) return bad_input(file.string() + " has no CompressedDataSize; save it again, not compressed");
    bytes = *size;
  }
  if (lower(name) == "local") return MaybeStored({file, header.length(), bytes, false});
  const Result<fs::path> data = named_file(file, name);
  if (!data) return tl::unexpected(data.error());
  return MaybeStored({*data, 0, bytes, false});
}

}  // namespace

std::string unpacked_head(const fs::path& file, std::size_t bytes) { return OpenFile(file).unpacked_head(bytes); }

VolumeFormat volume_format(const fs::path& file) {
  const std::string head = first_bytes(file);
  if (has(head, 344, "n+1") || has(head, 344, "ni1") || has(head, 4, "n+2") || has(head, 4, "ni2"))
    return VolumeFormat::nifti;
  if (has(head, 0, "NRRD000")) return VolumeFormat::nrrd;
  return has(head, 0, "ObjectType") || has(head, 0, "NDims") ? VolumeFormat::meta_image : VolumeFormat::none;
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

Result<void> check_kind(const fs::path& file, VolumeFormat format) {
  const std::string head = first_bytes(file);
  if (has(head, 4, "n+2") || has(head, 4, "ni2"))
    return failure(ErrorCode::unsupported, file.string() + " is NIfTI-2, which is not read; save it as NIfTI-1");
  const FileEndings endings = endings_of(format);
  const std::string name = file.string();
  const std::string_view wanted = is_packed(file) ? endings.packed : endings.plain;
  if (name.ends_with(wanted) || (!is_packed(file) && name.ends_with(endings.header))) return {};
  return bad_input(name + " is a " + std::string(name_of(format)) + " file" + (is_packed(file) ? ", compressed" : "") +
                   "; let its name end in " + std::string(wanted));
}

bool says_orientation(const fs::path& file, VolumeFormat format) {
  const std::string head = first_bytes(file);
  switch (format) {
    case VolumeFormat::nifti:
      return number_at<std::int16_t>(head, 252) != 0 || number_at<std::int16_t>(head, 254) != 0;
    case VolumeFormat::nrrd:
      return TextHeader(file, format).field("space").has_value();
    case VolumeFormat::meta_image:
    case VolumeFormat::none:
      break;
  }
  return true;  // MetaImage: LPS where it says nothing
}

Result<void> check_voxels(const fs::path& file, VolumeFormat format, std::uint64_t voxels, std::uint64_t voxel_bytes) {
  const std::uint64_t bytes = voxels * voxel_bytes;
  Result<MaybeStored> stored = format == VolumeFormat::nifti  ? Result<MaybeStored>(stored_nifti(file, voxels))
                               : format == VolumeFormat::nrrd ? stored_nrrd(file, bytes)
                                                              : stored_meta_image(file, bytes);
  if (!stored) return tl::unexpected(stored.error());
  if (!*stored) return {};
  const Stored& s = **stored;
  std::error_code error;
  const std::uint64_t there = fs::file_size(s.file, error);
  if (error)
    return failure(ErrorCode::not_found,
                   file.string() + " has its voxels in " + s.file.string() + ", which is not there; copy both files");
  const bool whole = s.packed ? s.bytes / kMostCompression <= there && OpenFile(s.file).has_unpacked(s.start, s.bytes)
                              : there >= s.start && there - s.start >= s.bytes;
  if (!whole) return bad_input(s.file.string() + " ends before its last voxel; copy or export it again");
  return {};
}

}  // namespace osteon::import
