// The files of a journal, as an interface. A test can put a disk under it that fails, tears writes and loses data.
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
  // Overwrites the bytes from an offset on. The file grows if they go beyond its end.
  [[nodiscard]] virtual Result<void> write_at(std::uint64_t from, std::string_view piece) = 0;
  [[nodiscard]] virtual Result<void> sync() = 0;  // makes what was written durable
  // The same as write_at() and sync(), but for these bytes only.
  [[nodiscard]] virtual Result<void> write_durably(std::uint64_t from, std::string_view piece) {
    return write_at(from, piece).and_then([&] { return sync(); });
  }
};

// The lock is held until it is destroyed, or until its process has ended in any way.
class DiskLock {
 public:
  virtual ~DiskLock() = default;
};
enum class LockKind { exclusive, shared };

// A folder for files that only this process needs. It is removed with all its contents.
class ScratchFolder {
 public:
  virtual ~ScratchFolder() = default;
  [[nodiscard]] virtual const std::filesystem::path& path() const = 0;
};

// Which file a name refers to. Two names of the same file have the same device and inode.
struct FileIdentity {
  std::uint64_t device = 0, inode = 0;
  std::uint64_t size = 0;  // bytes
  [[nodiscard]] bool same_file(const FileIdentity& other) const {
    return device == other.device && inode == other.inode;
  }
};

// Written bytes survive a power failure only after the file was synced. A file that was made, renamed or removed stays
// so only after its folder was synced. Any thread. Errors name the file and the system's reason: not_found, exists (a
// lock), invalid_input (a folder where a file should be, or a file where a folder should be), internal.
class Disk {
 public:
  virtual ~Disk() = default;
  // Makes an empty file. It replaces one that is there.
  [[nodiscard]] virtual Result<std::unique_ptr<DiskFile>> create(const std::filesystem::path& file) = 0;
  // Opens a file as it is, or makes an empty one.
  [[nodiscard]] virtual Result<std::unique_ptr<DiskFile>> open(const std::filesystem::path& file) = 0;
  [[nodiscard]] virtual Result<std::string> read(const std::filesystem::path& file, std::uint64_t from,
                                                 std::size_t most) = 0;
  // Nothing: no such file.
  [[nodiscard]] virtual Result<std::optional<FileIdentity>> identity(const std::filesystem::path& file) = 0;
  [[nodiscard]] Result<std::optional<std::uint64_t>> size(const std::filesystem::path& file);
  [[nodiscard]] virtual Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) = 0;
  [[nodiscard]] virtual Result<void> remove(const std::filesystem::path& file) = 0;  // a missing file is no error
  [[nodiscard]] virtual Result<void> sync_folder(const std::filesystem::path& folder) = 0;
  // Names of the files in a folder.
  [[nodiscard]] virtual Result<std::vector<std::string>> list(const std::filesystem::path& folder) = 0;
  // Locks the file itself, not its name, so the lock stays if the file is renamed. Errors: not_found; exists (another
  // process holds it); unsupported (this file system does not lock: a second process was not kept out).
  [[nodiscard]] virtual Result<std::unique_ptr<DiskLock>> lock(const std::filesystem::path& file, LockKind kind) = 0;
  [[nodiscard]] virtual Result<std::unique_ptr<ScratchFolder>> scratch_folder() = 0;
  // Name of SQLite's virtual file system that stores its files on this disk; empty: the system's.
  [[nodiscard]] virtual std::string vfs() const { return {}; }
};

// The disk of this computer.
[[nodiscard]] Disk& system_disk();

// The folder that contains a file, for sync_folder().
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& file);

struct WrittenFile {
  std::uint64_t size = 0;
  Digest digest;  // SHA-256 of its bytes
};

// A file that exists whole or not at all. It is written under another name in the same folder, synced and renamed, and
// its folder is synced.
class DurableFile {
 public:
  [[nodiscard]] static Result<DurableFile> begin(Disk& disk, const std::filesystem::path& file);
  DurableFile(DurableFile&&) noexcept;
  DurableFile& operator=(DurableFile&&) = delete;
  ~DurableFile();  // an unfinished file leaves nothing

  [[nodiscard]] Result<void> write(std::string_view piece);
  // Syncs what was written so far. Syncing in small parts keeps others from waiting long for the disk.
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

// What a user can do about an error of the system (an errno value), as the end of a sentence. Empty: nothing is known.
[[nodiscard]] std::string_view remedy_of(int reason);

// End of the name of a file that is still being written.
inline constexpr std::string_view kPartial = ".partial";

// Reads a file's bytes in parts of 1 MiB.
[[nodiscard]] Result<WrittenFile> read_in_pieces(Disk& disk, const std::filesystem::path& file,
                                                 const std::function<Result<void>(std::string_view)>& take);

}  // namespace osteon
