#include "server/import/found_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <system_error>

#include "server/import/archive_files.hpp"
#include "server/import/volume_format.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kIsoMark = 32769;  // after sixteen unused sectors

// The first elements of DICOM without a header, in one of the three plain encodings.
class Elements {
 public:
  Elements(std::span<const unsigned char> head, bool big, bool explicit_vr)
      : head_(head), big_(big), explicit_vr_(explicit_vr) {}

  // Four valid elements in rising order, the first of which can begin a data set.
  [[nodiscard]] bool sound() const {
    std::uint64_t at = 0;
    std::uint32_t before = 0;
    for (int i = 0; i < 4; ++i) {
      if (at + 12 > head_.size()) return false;
      const std::uint32_t group = u16(at), tag = group << 16 | u16(at + 2);
      if (i == 0 ? (group != 0x0002 && group != 0x0008) || u16(at + 2) > 0x0100 : tag <= before || group > 0x0028)
        return false;
      before = tag;
      std::uint64_t length = 0, header = 8;
      if (explicit_vr_) {
        static constexpr std::string_view kShort = "AE AS AT CS DA DS DT FL FD IS LO LT PN SH SL SS ST TM UI UL US";
        const std::string vr(reinterpret_cast<const char*>(head_.data()) + at + 4, 2);
        const bool is_short = vr.find(' ') == std::string::npos && kShort.find(vr) != std::string_view::npos;
        if (!is_short && vr != "OB" && vr != "UN" && vr != "SQ" && vr != "UT") return false;
        length = is_short ? u16(at + 6) : u32(at + 8);
        header = is_short ? 8 : 12;
      } else {
        length = u32(at + 4);
      }
      if (length % 2 != 0 || length > kLongest) return false;
      at += header + length;
    }
    return true;
  }

 private:
  [[nodiscard]] std::uint32_t u16(std::uint64_t at) const {
    const std::uint32_t a = head_[at], b = head_[at + 1];
    return big_ ? a << 8 | b : b << 8 | a;
  }
  [[nodiscard]] std::uint32_t u32(std::uint64_t at) const {
    return big_ ? u16(at) << 16 | u16(at + 2) : u16(at + 2) << 16 | u16(at);
  }

  static constexpr std::uint64_t kLongest = 512;  // of their values: character set, kind of image, dates, identifiers
  std::span<const unsigned char> head_;
  bool big_, explicit_vr_;
};

bool has(std::span<const unsigned char> bytes, std::size_t at, std::string_view mark) {
  return bytes.size() >= at + mark.size() && std::memcmp(bytes.data() + at, mark.data(), mark.size()) == 0;
}

bool is_zip(std::span<const unsigned char> head) {
  return has(head, 0, "PK\3\4") || has(head, 0, "PK\5\6") || has(head, 0, "PK\7\10");
}
bool is_gzip(std::span<const unsigned char> head) { return has(head, 0, "\x1f\x8b"); }
bool is_tar(std::span<const unsigned char> head) { return has(head, 257, "ustar"); }

// A file that is open while this object lives. Opening a pipe does not block.
class OpenedFile {
 public:
  explicit OpenedFile(const fs::path& file) : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~OpenedFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;
  std::size_t read(std::uint64_t at, std::span<unsigned char> bytes) const {
    const ssize_t n = descriptor_ < 0 ? -1 : ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    return n > 0 ? static_cast<std::size_t>(n) : 0;
  }

 private:
  int descriptor_;
};

// Walks one folder after the other, in the order that the disk gives.
class Walk {
 public:
  Walk(const fs::path& root, FoundFiles& found, const KeepGoing& keep_going)
      : root_(root), found_(found), keep_going_(keep_going) {}

  Result<void> folder(const fs::path& folder, int levels) {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      if (++seen_ % 256 == 0 && !keep_going_(0.0)) return stopped_while("listing " + root_.string());
      if (seen_ > kMostFiles)
        return failure(ErrorCode::invalid_input, root_.string() + " holds more than " + std::to_string(kMostFiles) +
                                                     " files; give the folder with the CT series");
      if (auto taken = take(*entry, levels); !taken) return taken;
    }
    if (!error) return {};
    if (folder == root_) return failure(ErrorCode::not_found, "cannot list " + root_.string() + ": " + error.message());
    found_.skipped.add(FileKind::unreadable, name_of(folder));
    return {};
  }

 private:
  std::string name_of(const fs::path& path) const { return path.lexically_relative(root_).string(); }

  Result<void> take(const fs::directory_entry& entry, int levels) {
    std::error_code error;
    const fs::file_status status = entry.status(error);
    if (fs::is_regular_file(status)) {
      found_.files.push_back({entry.path(), name_of(entry.path())});
    } else if (entry.is_symlink(error)) {
      found_.skipped.add(FileKind::link, name_of(entry.path()));
    } else if (!fs::is_directory(status)) {
      found_.skipped.add(FileKind::special, name_of(entry.path()));
    } else if (levels > 0) {
      return folder(entry.path(), levels - 1);
    } else if (levels == 0) {
      found_.skipped.add(FileKind::too_deep, name_of(entry.path()));
    }
    return {};
  }

  const fs::path& root_;
  FoundFiles& found_;
  const KeepGoing& keep_going_;
  int seen_ = 0;
};

}  // namespace

std::string FoundFiles::shown(std::size_t file) const {
  const std::string name = shown_text(files[file].name, 160);
  return archive ? input + ": " + name : (fs::path(input) / name).string();
}

Result<FoundFiles> find_files(const fs::path& folder, int levels, const KeepGoing& keep_going) {
  FoundFiles found;
  found.input = folder.string();
  if (auto walked = Walk(folder, found, keep_going).folder(folder, levels); !walked)
    return tl::unexpected(walked.error());
  std::ranges::sort(found.files, {}, &FoundFile::name);
  return found;
}

Content content_of(std::span<const unsigned char> head) {
  if (head.empty()) return Content::empty;
  if (has(head, 128, "DICM")) return Content::dicom;
  if (is_zip(head) || is_gzip(head) || is_tar(head) || has(head, 0, "7z\xbc\xaf") || has(head, 0, "Rar!"))
    return Content::archive;
  for (const bool big : {false, true})
    for (const bool explicit_vr : {false, true})
      if (Elements(head, big, explicit_vr).sound()) return Content::dicom;
  return Content::other;
}

InputKind input_kind(const fs::path& path, const KeepGoing& keep_going) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return InputKind::absent;
  if (fs::is_directory(status)) return InputKind::folder;
  if (!fs::is_regular_file(status)) return InputKind::other;
  const OpenedFile opened(path);
  std::array<unsigned char, kHeadBytes> bytes{};
  const std::span<const unsigned char> head(bytes.data(), opened.read(0, bytes));
  std::array<unsigned char, 5> mark{};
  if (opened.read(kIsoMark, mark) == mark.size() && has(mark, 0, "CD001")) return InputKind::archive;
  if (is_zip(head)) return InputKind::archive;
  if (volume_format(path) != VolumeFormat::none) return InputKind::volume_file;
  // An InVesalius project is a tar, compressed or not.
  if (is_gzip(head) || is_tar(head)) return path.extension() == ".inv3" ? InputKind::inv3 : tar_kind(path, keep_going);
  return content_of(head) == Content::dicom ? InputKind::dicom_file : InputKind::other;
}

}  // namespace osteon::import
