#include "viewer_client/desktop/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

namespace osteon {

// Children do not inherit it. Otherwise a child that outlives the window would hold it on.
FileLock::FileLock(const std::filesystem::path& file) : fd_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {}

FileLock::~FileLock() {
  if (fd_ >= 0) ::close(fd_);
}

bool FileLock::try_alone() { return take(LOCK_EX | LOCK_NB); }
bool FileLock::wait_alone() { return take(LOCK_EX); }
bool FileLock::wait_shared() { return take(LOCK_SH); }

bool FileLock::take(int how) const {
  if (fd_ < 0) return false;
  int done = 0;
  do done = ::flock(fd_, how);
  while (done != 0 && errno == EINTR);
  return done == 0;
}

}  // namespace osteon
