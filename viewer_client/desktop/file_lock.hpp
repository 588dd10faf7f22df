// A lock among the windows of one user.
#pragma once
#include <filesystem>

namespace osteon {

// The kernel releases it when its holder ends, however that happens. Two locks of one program exclude each other too.
class FileLock {
 public:
  // The file is made if it is missing, and stays. Its folder must be there.
  explicit FileLock(const std::filesystem::path& file);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  // False: the file cannot be made, as on a disk that may only be read. Then no lock is ever held.
  [[nodiscard]] bool usable() const { return fd_ >= 0; }
  // Each gives up what this object held before. Returns whether it holds the lock now.
  bool try_alone();    // false: another holds it
  bool wait_alone();   // until all others have given it up
  bool wait_shared();  // until nobody holds it alone

 private:
  bool take(int how) const;

  int fd_;
};

}  // namespace osteon
