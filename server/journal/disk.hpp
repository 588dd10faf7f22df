// The files of a journal, as an interface: so that a test can put a disk under it that fails, tears and forgets.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"

namespace osteon {

// A file that is open for writing.
class DiskFile {
 public:
  virtual ~DiskFile() = default;
  [[nodiscard]] virtual Result<void> write(std::string_view piece) = 0;  // at its end
  // Writes over the bytes from an offset on. The file grows where they go beyond its end.
  [[nodiscard]] virtual Result<void> write_at(std::uint64_t from, std::string_view piece) = 0;
  [[nodiscard]] virtual Result<void> sync() = 0;  // what was written stays, whatever happens
  // The same as write_at() and sync(), of these bytes alone.
  [[nodiscard]] virtual Result<void> write_durably(std::uint64_t from, std::string_view piece) {
    return write_at(from, piece).and_then([&] { return sync(); });
  }
};

// Held until it is destroyed, or its process has ended in whatever way.
class DiskLock {
 public:
  virtual ~DiskLock() = default;
};
enum class LockKind { exclusive, shared };

// A folder for files that only this process needs. It is removed with all that is in it.
class ScratchFolder {
 public:
  virtual ~ScratchFolder() = default;
  [[nodiscard]] virtual const std::filesystem::path& path() const = 0;
};

// Which file a name stands for: two names of the same file have the same device and inode.
struct FileIdentity {
  std::uint64_t device = 0, inode = 0;
  std::uint64_t size = 0;  // bytes
  [[nodiscard]] bool same_file(const FileIdentity& other) const {
    return device == other.device && inode == other.inode;
  }
};

// What is written stays after a power failure only once the file was synced; what is made, renamed or removed, once its
// folder was. Any thread. Errors name the file and the system's reason: not_found, exists (a lock), invalid_input (a
// folder where a file should be, or a file where a folder), internal.
class Disk {
 public:
  virtual ~Disk() = default;
  // An empty file, in place of one that is there.
  [[nodiscard]] virtual Result<std::unique_ptr<DiskFile>> create(const std::filesystem::path& file) = 0;
  // A file as it is, or an empty one where there is none.
  [[nodiscard]] virtual Result<std::unique_ptr<DiskFile>> open(const std::filesystem::path& file) = 0;
  [[nodiscard]] virtual Result<std::string> read(const std::filesystem::path& file, std::uint64_t from,
                                                 std::size_t most) = 0;
  // Nothing: no such file.
  [[nodiscard]] virtual Result<std::optional<FileIdentity>> identity(const std::filesystem::path& file) = 0;
  [[nodiscard]] Result<std::optional<std::uint64_t>> size(const std::filesystem::path& file);
  [[nodiscard]] virtual Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) = 0;
  [[nodiscard]] virtual Result<void> remove(const std::filesystem::path& file) = 0;  // one that is not there is well
  [[nodiscard]] virtual Result<void> sync_folder(const std::filesystem::path& folder) = 0;
  // The names of the files in a folder.
  [[nodiscard]] virtual Result<std::vector<std::string>> list(const std::filesystem::path& folder) = 0;
  // Locks the file itself, whatever its name is or becomes. Errors: not_found; exists (another process holds it);
  // unsupported (a second process was not kept out: this file system does not lock).
  [[nodiscard]] virtual Result<std::unique_ptr<DiskLock>> lock(const std::filesystem::path& file, LockKind kind) = 0;
  [[nodiscard]] virtual Result<std::unique_ptr<ScratchFolder>> scratch_folder() = 0;
  // The name of SQLite's virtual file system that keeps its files on this disk; empty: the system's.
  [[nodiscard]] virtual std::string vfs() const { return {}; }
};

// The computer's.
[[nodiscard]] Disk& system_disk();

// The folder that a file is in, as sync_folder() wants it.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& file);

struct WrittenFile {
  std::uint64_t size = 0;
  Digest digest;  // SHA-256 of its bytes
};

// A file that is there whole or not at all: written beside its place, synced, renamed, its folder synced.
class DurableFile {
 public:
  [[nodiscard]] static Result<DurableFile> begin(Disk& disk, const std::filesystem::path& file);
  DurableFile(DurableFile&&) noexcept;
  DurableFile& operator=(DurableFile&&) = delete;
  ~DurableFile();  // one that was not finished leaves nothing

  [[nodiscard]] Result<void> write(std::string_view piece);
  // Keeps what is there so far: where the disk takes it bit by bit, nobody else waits long for it.
  [[nodiscard]] Result<void> sync() { return partial_->sync(); }
  [[nodiscard]] Result<WrittenFile> finish();  // once

 private:
  DurableFile(Disk& disk, std::filesystem::path file) : disk_(&disk), file_(std::move(file)) {}
  Disk* disk_;
  std::filesystem::path file_;
  std::unique_ptr<DiskFile> partial_;
  Hasher hasher_;
  std::uint64_t size_ = 0;
};

// What a user can do about a reason of the system's (an errno value), as the end of a sentence; empty: nothing is
// known.
[[nodiscard]] std::string_view remedy_of(int reason);

// The end of the name of a file that is still being written.
inline constexpr std::string_view kPartial = ".partial";

// A file's bytes in pieces of 1 MiB.
[[nodiscard]] Result<WrittenFile> read_in_pieces(Disk& disk, const std::filesystem::path& file,
                                                 const std::function<Result<void>(std::string_view)>& take);

}  // namespace osteon
