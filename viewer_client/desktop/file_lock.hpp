// A lock on a file, by which the windows of one user exclude each other.
#pragma once
#include <filesystem>

namespace osteon {

// The kernel releases the lock when its holder ends, also by a crash. Two objects in one program exclude each other
// too.
class FileLock {
 public:
  // Makes the file if it is missing, and never removes it. Its folder must exist.
  explicit FileLock(const std::filesystem::path& file);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  // False: the file cannot be opened or made, as on a read-only disk. Then this object never holds the lock.
  [[nodiscard]] bool usable() const { return fd_ >= 0; }
  // Each call replaces the lock that this object held before. Returns whether the object holds the lock now.
  bool try_alone();    // exclusive; false: another object holds the lock
  bool wait_alone();   // exclusive; waits until all others have released it
  bool wait_shared();  // shared; waits until nobody holds it exclusively

 private:
  bool take(int how) const;

  int fd_;
};

}  // namespace osteon
