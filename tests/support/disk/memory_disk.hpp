// A disk in memory that loses, tears and fails like real disks, deterministic by its seed. One store serves the files
// of server/journal/disk.hpp and, as a virtual file system, SQLite.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/journal/disk.hpp"

namespace osteon::test {

// Written bytes can be read at once. If the power fails, each sector written since its last sync is old, new, torn
// between the two, or spoiled. Names that were made, changed or removed may be lost until their folder was synced.
// After a failed sync a sector may look written and never be written (as Linux does), or be as before. Not
// synchronised: one thread. Construction also seeds SQLite's generator, which is the process's.
class MemoryDisk final : public Disk {
 public:
  explicit MemoryDisk(std::uint64_t seed, std::size_t sector_bytes = 4096);
  ~MemoryDisk() override;
  MemoryDisk(const MemoryDisk&) = delete;
  MemoryDisk& operator=(const MemoryDisk&) = delete;

  Result<std::unique_ptr<DiskFile>> create(const std::filesystem::path& file) override;
  Result<std::unique_ptr<DiskFile>> open(const std::filesystem::path& file) override;
  Result<std::string> read(const std::filesystem::path& file, std::uint64_t from, std::size_t most) override;
  Result<std::optional<FileIdentity>> identity(const std::filesystem::path& file) override;
  Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) override;
  Result<void> remove(const std::filesystem::path& file) override;
  Result<void> sync_folder(const std::filesystem::path& folder) override;
  Result<std::vector<std::string>> list(const std::filesystem::path& folder) override;
  Result<std::unique_ptr<DiskLock>> lock(const std::filesystem::path& file, LockKind kind) override;
  Result<std::unique_ptr<ScratchFolder>> scratch_folder() override;
  std::string vfs() const override;

  // Faults. They count from now on, 1 is the next call. `error` is an errno value: EIO, ENOSPC.
  enum class Lasting { once, from_then_on };
  void fail_at(std::uint64_t n, int error, Lasting lasting = Lasting::once);  // the n-th write or sync
  void fail_write_at(std::uint64_t n, int error,
                     Lasting lasting = Lasting::once);  // writes, and new, renamed, removed names
  void fail_sync_at(std::uint64_t n, int error, Lasting lasting = Lasting::once);  // of files and folders
  // The power fails at the n-th write or sync. That call and all later ones fail, reads too, until power_returns().
  void fail_power_at(std::uint64_t n);
  // Unsynced data may be lost. No file may be open.
  void power_returns();
  void mend();                                               // removes all planned faults
  [[nodiscard]] bool has_failed() const { return failed_; }  // since the last mend() or power_returns()

  // Damage; it is synced at once.
  void flip_bit(const std::filesystem::path& file, std::uint64_t bit);
  void cut(const std::filesystem::path& file, std::uint64_t size);
  void put(const std::filesystem::path& file, std::string bytes);
  using Image = std::map<std::string, std::string>;  // bytes by path
  [[nodiscard]] Image image() const;
  void load(const Image& image);  // replaces all content; all synced

  struct Counts {
    std::uint64_t writes = 0, syncs = 0, written_bytes = 0;
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }
  [[nodiscard]] std::size_t sector_bytes() const { return sector_bytes_; }

  struct Sqlite;                              // the virtual file system
  struct Content;                             // of a file
  using Contents = std::shared_ptr<Content>;  // held by its names, and by whoever has it open after its removal

 private:
  friend struct Sqlite;
  class OpenFile;
  class HeldLock;
  class Scratch;
  struct Fault {
    std::uint64_t at = 0;  // counts down; 0: none
    int error = 0;
    Lasting lasting = Lasting::once;
    int next();
  };
  // 0, or the errno value with which the call fails.
  [[nodiscard]] int before(std::uint64_t& count, Fault& fault);
  [[nodiscard]] int before_write() { return before(counts_.writes, write_fault_); }
  [[nodiscard]] int before_sync() { return before(counts_.syncs, sync_fault_); }
  [[nodiscard]] int write_at(Content& content, std::uint64_t from, std::string_view bytes);
  [[nodiscard]] int truncate(Content& content, std::uint64_t size);
  [[nodiscard]] int sync(Content& content);
  [[nodiscard]] int sync_names(const std::string& folder);
  [[nodiscard]] int change_names(std::vector<std::pair<std::string, Contents>> change);
  [[nodiscard]] Contents find(const std::string& name) const;
  void lose_power(Content& content);
  bool chance(std::uint64_t in) { return random_() % in == 0; }

  std::mt19937_64 random_;
  std::size_t sector_bytes_;
  std::map<std::string, Contents> names_, synced_names_;
  // Changes not yet synced, oldest first: the new content of these names (null: removed). Each element is one atomic
  // change.
  std::vector<std::vector<std::pair<std::string, Contents>>> changes_;
  std::uint64_t boots_ = 0;  // locks end with the power
  std::uint64_t scratches_ = 0;
  Fault fault_, write_fault_, sync_fault_, power_fault_;
  bool off_ = false, failed_ = false;
  int open_files_ = 0;
  int last_error_ = 0;
  Counts counts_;
  std::unique_ptr<Sqlite> sqlite_;
};

}  // namespace osteon::test
