#include "server/import/archive_files.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "server/import/isolated_reader.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChunk = 1 << 18;

struct CloseArchive {
  void operator()(archive* a) const { archive_read_free(a); }
};
using Archive = std::unique_ptr<archive, CloseArchive>;

Archive new_archive() {
  Archive a(archive_read_new());
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_zip(a.get());
  archive_read_support_format_iso9660(a.get());
  archive_read_support_format_tar(a.get());
  return a;
}

std::string reason_of(archive* a) {
  const char* reason = archive_error_string(a);
  return reason != nullptr ? shown_text(reason, 100) : "unknown reason";
}

// A file that is either written completely or removed.
class Output {
 public:
  explicit Output(const fs::path& path)
      : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600)) {}
  ~Output() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  bool write(const char* from, std::size_t size) const {
    return descriptor_ >= 0 && write_all(descriptor_, from, size);
  }

 private:
  int descriptor_;
};

class Unpacker {
 public:
  Unpacker(const fs::path& file, const fs::path& into, const ArchiveLimits& limits, const KeepGoing& keep_going)
      : file_(file), into_(into), limits_(limits), keep_going_(keep_going), archive_(new_archive()), piece_(kChunk) {
    found_.input = file.string();
    found_.archive = true;
  }

  Result<FoundFiles> run() {
    std::error_code error;
    size_ = std::max<double>(1.0, static_cast<double>(fs::file_size(file_, error)));
    struct statvfs disk {};
    if (::statvfs(into_.c_str(), &disk) == 0) {
      const std::uint64_t free = static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize;
      room_ = free - std::min(free, limits_.spare_bytes);
    }
    if (archive_read_open_filename(archive_.get(), file_.c_str(), kChunk) != ARCHIVE_OK) return damaged();
    int entries = 0;
    for (archive_entry* entry = nullptr;;) {
      const int status = archive_read_next_header(archive_.get(), &entry);
      if (status == ARCHIVE_EOF) break;
      if (status != ARCHIVE_OK && status != ARCHIVE_WARN) return damaged();
      if (++entries > limits_.entries)
        return failure(ErrorCode::invalid_input, file_.string() + " has more than " + std::to_string(limits_.entries) +
                                                     " entries; unpack it and give the folder with the CT series");
      if (auto taken = take(entry); !taken) return tl::unexpected(taken.error());
    }
    if (!has_end())
      return failure(ErrorCode::invalid_input,
                     file_.string() + " is truncated (it has no end); copy or export it again");
    std::ranges::sort(found_.files, {}, &FoundFile::name);
    return std::move(found_);
  }

 private:
  // A tar ends with two blocks of zeros. The library does not report their absence.
  [[nodiscard]] bool has_end() const {
    if ((archive_format(archive_.get()) & ARCHIVE_FORMAT_BASE_MASK) != ARCHIVE_FORMAT_TAR ||
        archive_filter_code(archive_.get(), 0) != ARCHIVE_FILTER_NONE)
      return true;
    std::array<char, 1024> end{};
    std::ifstream in(file_, std::ios::binary);
    in.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
    return in.read(end.data(), end.size()) && std::ranges::all_of(end, [](char c) { return c == 0; });
  }
  [[nodiscard]] tl::unexpected<Error> damaged() const {
    return failure(ErrorCode::invalid_input, file_.string() + " is truncated or damaged (" + reason_of(archive_.get()) +
                                                 "); copy or export it again");
  }
  [[nodiscard]] bool go_on() {
    const double done = static_cast<double>(archive_filter_bytes(archive_.get(), -1)) / size_;
    return keep_going_(std::clamp(done, 0.0, 1.0));
  }
  [[nodiscard]] tl::unexpected<Error> stopped() const { return stopped_while("unpacking " + file_.string()); }

  // The next bytes of the entry, up to a full buffer; none at its end. A single entry may be damaged.
  Result<std::optional<std::size_t>> read_piece() {
    std::size_t got = 0;
    while (got < piece_.size()) {
      const la_ssize_t n = archive_read_data(archive_.get(), piece_.data() + got, piece_.size() - got);
      if (n == ARCHIVE_FATAL) return damaged();
      if (n == ARCHIVE_RETRY) continue;
      if (n < 0) return std::optional<std::size_t>{};
      if (n == 0) break;
      got += static_cast<std::size_t>(n);
    }
    return std::optional<std::size_t>(got);
  }

  Result<void> take(archive_entry* entry) {
    if (!go_on()) return stopped();
    const char* given = archive_entry_pathname(entry);
    if (given == nullptr) given = archive_entry_pathname_utf8(entry);
    const std::string name = given != nullptr ? std::string(given).substr(0, 1024) : "without a name";
    if (archive_entry_is_encrypted(entry) != 0)
      return failure(ErrorCode::invalid_input,
                     file_.string() + " is encrypted; unpack it with its password and give the folder");
    if (archive_entry_symlink(entry) != nullptr || archive_entry_hardlink(entry) != nullptr)
      return skip(FileKind::link, name);
    if (archive_entry_filetype(entry) == AE_IFDIR) return {};
    if (archive_entry_filetype(entry) != AE_IFREG) return skip(FileKind::special, name);

    auto got = read_piece();
    if (!got) return tl::unexpected(got.error());
    if (!*got) return skip(FileKind::damaged, name);
    const std::size_t head = std::min(**got, kHeadBytes);
    switch (content_of({reinterpret_cast<const unsigned char*>(piece_.data()), head})) {
      case Content::empty:
        return skip(FileKind::empty, name);
      case Content::archive:
        return skip(FileKind::archive, name);
      case Content::other:
        return skip(FileKind::not_dicom, name);
      case Content::dicom:
        return write(name, **got);
    }
    return {};
  }

  Result<void> skip(FileKind kind, const std::string& name) {
    found_.skipped.add(kind, name);
    if (archive_filter_code(archive_.get(), 0) == ARCHIVE_FILTER_NONE) return {};
    // A packed tar is read to its end anyway. Reading it here allows the user to stop it.
    for (;;) {
      const auto got = read_piece();
      if (!got) return tl::unexpected(got.error());
      if (!*got || **got == 0) return {};
      if (!go_on()) return stopped();
    }
  }

  Result<void> write(const std::string& name, std::size_t got) {
    const fs::path path = into_ / std::to_string(found_.files.size());
    const Output out(path);
    for (;;) {
      bytes_ += got;
      if (bytes_ > limits_.bytes)
        return too_large("more than the " + gigabytes(limits_.bytes) + " of DICOM that are unpacked");
      if (bytes_ > room_)
        return too_large("more DICOM than the disk of " + into_.parent_path().string() + " has room for");
      if (!out.write(piece_.data(), got))
        return failure(ErrorCode::internal, "cannot write to " + into_.parent_path().string() + " (" +
                                                std::strerror(errno) +
                                                "); make room there or set TMPDIR to another folder");
      if (!go_on()) return stopped();
      const auto next = read_piece();
      if (!next) return tl::unexpected(next.error());
      if (!*next) {
        std::error_code error;
        fs::remove(path, error);
        found_.skipped.add(FileKind::damaged, name);
        return {};
      }
      got = **next;
      if (got == 0) break;
    }
    found_.files.push_back({path, name});
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> too_large(const std::string& what) const {
    return failure(ErrorCode::exhausted,
                   file_.string() + " holds " + what +
                       "; unpack the CT series alone and give its folder, or set TMPDIR to a larger disk");
  }
  static std::string gigabytes(std::uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g GiB", static_cast<double>(bytes) / static_cast<double>(1 << 30));
    return text;
  }

  const fs::path& file_;
  const fs::path& into_;
  const ArchiveLimits& limits_;
  const KeepGoing& keep_going_;
  Archive archive_;
  std::vector<char> piece_;
  FoundFiles found_;
  double size_ = 1.0;
  std::uint64_t bytes_ = 0;
  std::uint64_t room_ = std::numeric_limits<std::uint64_t>::max();
};

}  // namespace

Result<TemporaryFolder> TemporaryFolder::make() {
  std::error_code error;
  const fs::path parent = fs::temp_directory_path(error);
  std::string name = (parent / "osteon-import-XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr)
    return failure(ErrorCode::internal, "cannot make a temporary folder in " + parent.string() + " (" +
                                            (error ? error.message() : std::strerror(errno)) +
                                            "); set TMPDIR to a folder that can be written");
  return TemporaryFolder(name);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  if (!path_.empty()) fs::remove_all(path_, error);
}

Result<FoundFiles> unpack_archive(const fs::path& archive, const fs::path& into, const ArchiveLimits& limits,
                                  const KeepGoing& keep_going) {
  return Unpacker(archive, into, limits, keep_going).run();
}

namespace {

InputKind kind_by_entries(const fs::path& archive, ChildChannel& channel) {
  const Archive a = new_archive();
  if (archive_read_open_filename(a.get(), archive.c_str(), kChunk) != ARCHIVE_OK) return InputKind::other;
  archive_entry* entry = nullptr;
  for (int entries = 0; entries < kMostFiles; ++entries) {
    const int status = archive_read_next_header(a.get(), &entry);
    if (status != ARCHIVE_OK && status != ARCHIVE_WARN) return entries == 0 ? InputKind::other : InputKind::archive;
    const char* path = archive_entry_pathname(entry);
    if (path != nullptr && fs::path(path).filename() == "main.plist") return InputKind::inv3;
    // Read in parts and not skipped at once, so that the parent sees that the child is alive.
    const void* data = nullptr;
    std::size_t size = 0;
    la_int64_t offset = 0;
    do channel.progress(0.0);
    while (archive_read_data_block(a.get(), &data, &size, &offset) == ARCHIVE_OK);
  }
  return InputKind::archive;
}

}  // namespace

InputKind tar_kind(const fs::path& archive, const KeepGoing& keep_going) {
  InputKind kind = InputKind::other;
  IsolatedWork work;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    const char found = static_cast<char>(kind_by_entries(archive, channel));
    channel.send(std::string_view(&found, 1));
    return {};
  };
  work.on_message = [&](std::string_view message) {
    if (message.size() != 1) return false;
    for (const InputKind known : {InputKind::inv3, InputKind::archive})
      if (message.front() == static_cast<char>(known)) kind = known;
    return true;
  };
  (void)run_isolated(work, keep_going);  // if it cannot be read, the kind stays `other`
  return kind;
}

}  // namespace osteon::import
