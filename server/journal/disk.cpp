#include "server/journal/disk.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <set>
#include <system_error>
#include <utility>

#include "common/core/mutex.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = std::size_t{1} << 20;

tl::unexpected<Error> cannot(const char* what, const fs::path& file, int reason) {
  const ErrorCode code = reason == ENOENT                        ? ErrorCode::not_found
                         : reason == EISDIR || reason == ENOTDIR ? ErrorCode::invalid_input
                                                                 : ErrorCode::internal;
  return failure(code, "cannot " + std::string(what) + " " + file.string() + ": " +
                           std::generic_category().message(reason) + std::string(remedy_of(reason)));
}

// If a file that was to be made is missing, its folder is missing.
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

  Result<void> write_at(std::uint64_t from, std::string_view piece) override {
    while (!piece.empty()) {
      const ssize_t put = ::pwrite(fd_.get(), piece.data(), piece.size(), static_cast<off_t>(from));
      if (put < 0 && errno == EINTR) continue;
      if (put < 0) return cannot("write", file_, errno);
      piece.remove_prefix(static_cast<std::size_t>(put));
      from += static_cast<std::uint64_t>(put);
    }
    return {};
  }

  // A single call: some disks then do not have to flush their whole cache.
  Result<void> write_durably(std::uint64_t from, std::string_view piece) override {
    while (!piece.empty()) {
      const iovec bytes{const_cast<char*>(piece.data()), piece.size()};
      const ssize_t put = ::pwritev2(fd_.get(), &bytes, 1, static_cast<off_t>(from), RWF_DSYNC);
      if (put < 0 && errno == EINTR) continue;
      if (put < 0 && errno == EOPNOTSUPP) return DiskFile::write_durably(from, piece);
      if (put < 0) return cannot("write", file_, errno);
      piece.remove_prefix(static_cast<std::size_t>(put));
      from += static_cast<std::uint64_t>(put);
    }
    return {};
  }

  // Syncs data and size, but no times. So overwriting a file does not change the metadata of the file system.
  Result<void> sync() override {
    if (::fdatasync(fd_.get()) != 0) return cannot("sync", file_, errno);
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

class SystemScratch final : public ScratchFolder {
 public:
  explicit SystemScratch(fs::path path) : path_(std::move(path)) {}
  ~SystemScratch() override {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  SystemScratch(const SystemScratch&) = delete;
  SystemScratch& operator=(const SystemScratch&) = delete;
  [[nodiscard]] const fs::path& path() const override { return path_; }

 private:
  fs::path path_;
};

// Whether this lock excludes a second process. Some file systems grant the lock to everybody.
Result<bool> keeps_others_out(const fs::path& file) {
  const char* name = file.c_str();
  const pid_t child = ::fork();
  if (child < 0) return cannot("start a process that tries the lock of", file, errno);
  if (child == 0) {  // only calls that are safe after a fork of a process with many threads
    const int fd = ::open(name, O_RDONLY | O_CLOEXEC);
    ::_exit(fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK ? 0 : 1);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return cannot("wait for the process that tries the lock of", file, errno);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

class SystemDisk final : public Disk {
 public:
  Result<std::unique_ptr<DiskFile>> create(const fs::path& file) override {
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (fd < 0) return cannot_make("create", file, errno);
    return std::make_unique<SystemFile>(file, fd);
  }

  Result<std::unique_ptr<DiskFile>> open(const fs::path& file) override {
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0) return cannot_make("open", file, errno);
    auto opened = std::make_unique<SystemFile>(file, fd);
    if (::lseek(fd, 0, SEEK_END) < 0) return cannot("open", file, errno);  // where write() continues
    return opened;
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

  // Does not ask for times. Whoever asks for them makes the next write record them again, and then the next sync takes
  // twice as long.
  Result<std::optional<FileIdentity>> identity(const fs::path& file) override {
    struct statx about {};
    if (::statx(AT_FDCWD, file.c_str(), 0, STATX_INO | STATX_SIZE, &about) == 0)
      return FileIdentity{std::uint64_t{about.stx_dev_major} << 32 | about.stx_dev_minor, about.stx_ino,
                          about.stx_size};
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

  // flock() and not just a file that exists: the lock ends with its holder, even if that was killed. It does not end
  // when this process closes the file elsewhere. The fcntl() locks that SQLite uses do end then.
  Result<std::unique_ptr<DiskLock>> lock(const fs::path& file, LockKind kind) override {
    for (;;) {
      int fd = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
      if (fd < 0 && (errno == EACCES || errno == EROFS)) fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
      if (fd < 0) return cannot("open", file, errno);
      auto held = std::make_unique<SystemLock>(fd);
      if (::flock(fd, (kind == LockKind::exclusive ? LOCK_EX : LOCK_SH) | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK) return cannot("lock", file, errno);
        return failure(ErrorCode::exists, file.string() + " is held by another process");
      }
      // The holder may have removed or renamed the file before it released the lock. Then the name refers to another
      // file.
      struct stat mine {
      }, named{};
      if (::fstat(fd, &mine) != 0) return cannot("look at", file, errno);
      if (::stat(file.c_str(), &named) != 0 || mine.st_dev != named.st_dev || mine.st_ino != named.st_ino) continue;
      if (kind == LockKind::shared) return held;
      if (const Result<void> proved = prove_lock(file, mine.st_dev); !proved) return tl::unexpected(proved.error());
      return held;
    }
  }

  Result<std::unique_ptr<ScratchFolder>> scratch_folder() override {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "osteon-journal.XXXXXX").string();
    if (error || ::mkdtemp(name.data()) == nullptr)
      return failure(ErrorCode::internal, "cannot make a folder for a copy of the journal in " + name + ": " +
                                              (error ? error.message() : std::generic_category().message(errno)) +
                                              "; name a folder that can be written to in TMPDIR");
    return std::make_unique<SystemScratch>(name);
  }

 private:
  // Once for each file system in the life of the process.
  Result<void> prove_lock(const fs::path& file, dev_t device) {
    const MutexLock one_at_a_time(proving_);
    if (proved_.contains(device)) return {};
    const Result<bool> held = keeps_others_out(file);
    if (!held) return tl::unexpected(held.error());
    if (!*held)
      return failure(ErrorCode::unsupported, file.string() +
                                                 " lies on a file system that does not lock files, so two "
                                                 "servers could write to it; choose a place on a local disk");
    proved_.insert(device);
    return {};
  }
  Mutex proving_{LockRank::leaf};
  std::set<dev_t> proved_ OSTEON_GUARDED_BY(proving_);
};

fs::path partial_of(const fs::path& file) {
  fs::path partial = file;
  partial += kPartial;
  return partial;
}

}  // namespace

Result<std::optional<std::uint64_t>> Disk::size(const fs::path& file) {
  return identity(file).map([](const auto& it) { return it ? std::optional(it->size) : std::nullopt; });
}

Disk& system_disk() {
  static SystemDisk disk;
  return disk;
}

std::string_view remedy_of(int reason) {
  switch (reason) {
    case EACCES:
    case EPERM:
      return "; see to the permissions, or choose another place";
    case EROFS:
      return "; choose a place that can be written to";
    case ENOSPC:
    case EDQUOT:
      return "; make room on the disk";
    case EISDIR:
      return "; name a file, not a folder";
    case ENOTDIR:
      return "; name a file in a folder";
    default:
      return {};
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

Result<WrittenFile> read_in_pieces(Disk& disk, const fs::path& file,
                                   const std::function<Result<void>(std::string_view)>& take) {
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
