#include "server/journal/disk.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = std::size_t{1} << 20;

tl::unexpected<Error> cannot(const char* what, const fs::path& file, int reason) {
  const ErrorCode code = reason == ENOENT                         ? ErrorCode::not_found
                         : reason == EISDIR || reason == ENOTDIR ? ErrorCode::invalid_input
                                                                 : ErrorCode::internal;
  return failure(code, "cannot " + std::string(what) + " " + file.string() + ": " + std::generic_category().message(reason) +
                           std::string(remedy_of(reason)));
}

// A file that was to be made is missing only because its folder is.
tl::unexpected<Error> cannot_make(const char* what, const fs::path& file, int reason) {
  if (reason != ENOENT) return cannot(what, file, reason);
  return failure(ErrorCode::not_found,
                 "there is no folder " + folder_of(file).string() + " for " + file.string() + "; make it first");
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

class SystemFile final : public DiskFile {
 public:
  SystemFile(fs::path file, int fd) : file_(std::move(file)), fd_(fd) {}

  Result<void> write(std::string_view piece) override {
    while (!piece.empty()) {
      const ssize_t put = ::write(fd_.get(), piece.data(), piece.size());
      if (put < 0 && errno == EINTR) continue;
      if (put < 0) return cannot("write", file_, errno);
      piece.remove_prefix(static_cast<std::size_t>(put));
    }
    return {};
  }

  Result<void> sync() override {
    if (::fsync(fd_.get()) != 0) return cannot("sync", file_, errno);
    return {};
  }

 private:
  fs::path file_;
  Descriptor fd_;
};

class SystemLock final : public DiskLock {
 public:
  explicit SystemLock(int fd) : fd_(fd) {}

 private:
  Descriptor fd_;  // flock() holds as long as it is open
};

class SystemDisk final : public Disk {
 public:
  Result<std::unique_ptr<DiskFile>> create(const fs::path& file) override {
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) return cannot_make("create", file, errno);
    return std::make_unique<SystemFile>(file, fd);
  }

  Result<std::string> read(const fs::path& file, std::uint64_t from, std::size_t most) override {
    const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    if (fd.get() < 0) return cannot("open", file, errno);
    std::string bytes(most, '\0');
    std::size_t have = 0;
    while (have < most) {
      const ssize_t got = ::pread(fd.get(), bytes.data() + have, most - have, static_cast<off_t>(from + have));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return cannot("read", file, errno);
      if (got == 0) break;
      have += static_cast<std::size_t>(got);
    }
    bytes.resize(have);
    return bytes;
  }

  Result<std::optional<std::uint64_t>> size(const fs::path& file) override {
    struct stat about {};
    if (::stat(file.c_str(), &about) == 0) return static_cast<std::uint64_t>(about.st_size);
    if (errno == ENOENT) return std::nullopt;
    return cannot("look at", file, errno);
  }

  Result<void> rename(const fs::path& from, const fs::path& to) override {
    if (::rename(from.c_str(), to.c_str()) != 0) return cannot("rename", from, errno);
    return {};
  }

  Result<void> remove(const fs::path& file) override {
    if (::unlink(file.c_str()) != 0 && errno != ENOENT) return cannot("remove", file, errno);
    return {};
  }

  Result<void> sync_folder(const fs::path& folder) override {
    const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (fd.get() < 0) return cannot("open", folder, errno);
    if (::fsync(fd.get()) != 0) return cannot("sync", folder, errno);
    return {};
  }

  Result<std::vector<std::string>> list(const fs::path& folder) override {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
      names.push_back(entry->path().filename().string());
    if (error.value() == ENOENT)
      return failure(ErrorCode::not_found, "there is no folder " + folder.string() + "; make it first");
    if (error) return cannot("list", folder, error.value());
    return names;
  }

  // flock() rather than a file that merely exists: it ends with its holder, even one that was killed. The file stays, but
  // its holder may remove it: who has just opened the old one would then hold a lock of no name, and opens it anew.
  Result<std::unique_ptr<DiskLock>> lock(const fs::path& file) override {
    for (;;) {
      const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
      if (fd < 0) return cannot_make("open", file, errno);
      auto held = std::make_unique<SystemLock>(fd);
      if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK) return cannot("lock", file, errno);
        return failure(ErrorCode::exists, file.string() + " is held by another process");
      }
      struct stat mine {}, named {};
      if (::fstat(fd, &mine) != 0) return cannot("look at", file, errno);
      if (::stat(file.c_str(), &named) == 0 && mine.st_dev == named.st_dev && mine.st_ino == named.st_ino) return held;
    }
  }
};

fs::path partial_of(const fs::path& file) {
  fs::path partial = file;
  partial += kPartial;
  return partial;
}

}  // namespace

Disk& system_disk() {
  static SystemDisk disk;
  return disk;
}

std::string_view remedy_of(int reason) {
  switch (reason) {
    case EACCES:
    case EPERM: return "; see to the permissions, or choose another place";
    case EROFS: return "; choose a place that can be written to";
    case ENOSPC:
    case EDQUOT: return "; make room on the disk";
    case EISDIR: return "; name a file, not a folder";
    case ENOTDIR: return "; name a file in a folder";
    default: return {};
  }
}

fs::path folder_of(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

Result<DurableFile> DurableFile::begin(Disk& disk, const fs::path& file) {
  DurableFile made(disk, file);
  auto partial = disk.create(partial_of(file));
  if (!partial) return tl::unexpected(partial.error());
  made.partial_ = std::move(*partial);
  return made;
}

DurableFile::DurableFile(DurableFile&&) noexcept = default;

DurableFile::~DurableFile() {
  if (!partial_) return;
  partial_.reset();
  static_cast<void>(disk_->remove(partial_of(file_)));
}

Result<void> DurableFile::write(std::string_view piece) {
  hasher_.bytes(std::as_bytes(std::span(piece)));
  size_ += piece.size();
  return partial_->write(piece);
}

Result<WrittenFile> DurableFile::finish() {
  if (Result<void> done = partial_->sync(); !done) return tl::unexpected(done.error());
  if (Result<void> done = disk_->rename(partial_of(file_), file_); !done) return tl::unexpected(done.error());
  partial_.reset();
  if (Result<void> done = disk_->sync_folder(folder_of(file_)); !done) return tl::unexpected(done.error());
  return WrittenFile{size_, hasher_.finish()};
}

Result<WrittenFile> read_in_pieces(Disk& disk, const fs::path& file, const std::function<Result<void>(std::string_view)>& take) {
  WrittenFile read;
  Hasher hasher;
  for (;;) {
    const Result<std::string> piece = disk.read(file, read.size, kPiece);
    if (!piece) return tl::unexpected(piece.error());
    if (piece->empty()) break;
    hasher.bytes(std::as_bytes(std::span(*piece)));
    read.size += piece->size();
    if (const Result<void> taken = take(*piece); !taken) return tl::unexpected(taken.error());
  }
  read.digest = hasher.finish();
  return read;
}

}  // namespace osteon
