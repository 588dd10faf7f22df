// A library for LD_PRELOAD. Writes of a process into one folder fail as on a bad, a full or a read-only disk.
//
// OSTEON_FAILING_FOLDER names the folder, OSTEON_FAILING_CONTROL a file. Calls fail as long as that file exists. Its
// content is "ERRNO KINDS PASSED": an errno value; w for writes, s for syncs, n for calls that make or change names;
// and the number of such calls that still work at first.
#include <linux/fs.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

// Not <fcntl.h>: its declarations of open() differ with the width of offsets.
#define FAILING_CREAT 0100
#define FAILING_ACCESS_MODE 3
#define FAILING_AT_FDCWD (-100)

namespace {

struct Order {
  int reason = 0;  // errno; 0: nothing fails
  char kinds[8] = {};
  int passed = 0;
};

Order read_order() {
  Order order;
  const char* control = std::getenv("OSTEON_FAILING_CONTROL");
  if (control == nullptr) return order;
  const long fd = syscall(SYS_openat, FAILING_AT_FDCWD, control, 0, 0);
  if (fd < 0) return order;
  char text[64] = {};
  const long got = syscall(SYS_read, fd, text, sizeof text - 1);
  syscall(SYS_close, fd);
  if (got <= 0 || std::sscanf(text, "%d %7s %d", &order.reason, order.kinds, &order.passed) != 3) return {};
  return order;
}

bool in_folder(const char* path) {
  const char* folder = std::getenv("OSTEON_FAILING_FOLDER");
  return folder != nullptr && std::strncmp(path, folder, std::strlen(folder)) == 0;
}

bool in_folder(int fd) {
  char link[64], path[PATH_MAX] = {};
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  return syscall(SYS_readlinkat, FAILING_AT_FDCWD, link, path, sizeof path - 1) > 0 && in_folder(path);
}

std::atomic<int> seen{0};
std::atomic<bool> cut_short{false};

// Whether this call fails now. Then errno is set.
template <class Where>
bool fails(char kind, Where where) {
  const int before = errno;
  const Order order = read_order();
  const bool now = order.reason != 0 && std::strchr(order.kinds, kind) != nullptr && in_folder(where) &&
                   seen.fetch_add(1) >= order.passed;
  errno = now ? order.reason : before;
  return now;
}

// A full disk takes a part of the first write.
bool takes_part(std::size_t count) { return errno == ENOSPC && count > 1 && !cut_short.exchange(true); }

long open_file(int folder, const char* path, int flags, va_list more) {
  const int mode = (flags & FAILING_CREAT) != 0 ? va_arg(more, int) : 0;
  if ((flags & FAILING_ACCESS_MODE) != 0 && fails('n', path)) return -1;
  return syscall(SYS_openat, folder, path, flags, mode);
}

ssize_t write_vector(int fd, const iovec* parts, int count, long at, int flags) {
  if (fails('w', fd)) {
    if (count != 1 || !takes_part(parts->iov_len)) return -1;
    iovec half = *parts;
    half.iov_len /= 2;
    return syscall(SYS_pwritev2, fd, &half, 1, at, 0, flags);
  }
  if ((flags & (RWF_DSYNC | RWF_SYNC)) != 0 && fails('s', fd)) return -1;
  return syscall(SYS_pwritev2, fd, parts, count, at, 0, flags);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const long fd = open_file(FAILING_AT_FDCWD, path, flags, more);
  va_end(more);
  return static_cast<int>(fd);
}
int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const long fd = open_file(FAILING_AT_FDCWD, path, flags, more);
  va_end(more);
  return static_cast<int>(fd);
}
int openat(int folder, const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const long fd = open_file(folder, path, flags, more);
  va_end(more);
  return static_cast<int>(fd);
}

ssize_t write(int fd, const void* bytes, size_t count) {
  if (fails('w', fd)) return takes_part(count) ? syscall(SYS_write, fd, bytes, count / 2) : -1;
  return syscall(SYS_write, fd, bytes, count);
}
ssize_t pwrite(int fd, const void* bytes, size_t count, off_t at) {
  if (fails('w', fd)) return takes_part(count) ? syscall(SYS_pwrite64, fd, bytes, count / 2, at) : -1;
  return syscall(SYS_pwrite64, fd, bytes, count, at);
}
ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t at) {
  if (fails('w', fd)) return takes_part(count) ? syscall(SYS_pwrite64, fd, bytes, count / 2, at) : -1;
  return syscall(SYS_pwrite64, fd, bytes, count, at);
}
ssize_t pwritev2(int fd, const iovec* parts, int count, off_t at, int flags) {
  return write_vector(fd, parts, count, at, flags);
}
ssize_t pwritev64v2(int fd, const iovec* parts, int count, off64_t at, int flags) {
  return write_vector(fd, parts, count, at, flags);
}

int fsync(int fd) { return fails('s', fd) ? -1 : static_cast<int>(syscall(SYS_fsync, fd)); }
int fdatasync(int fd) { return fails('s', fd) ? -1 : static_cast<int>(syscall(SYS_fdatasync, fd)); }
int ftruncate(int fd, off_t size) noexcept {
  return fails('w', fd) ? -1 : static_cast<int>(syscall(SYS_ftruncate, fd, size));
}
int ftruncate64(int fd, off64_t size) noexcept {
  return fails('w', fd) ? -1 : static_cast<int>(syscall(SYS_ftruncate, fd, size));
}

int rename(const char* from, const char* to) noexcept {
  return fails('n', to) ? -1 : static_cast<int>(syscall(SYS_renameat, FAILING_AT_FDCWD, from, FAILING_AT_FDCWD, to));
}
int unlink(const char* path) noexcept {
  return fails('n', path) ? -1 : static_cast<int>(syscall(SYS_unlinkat, FAILING_AT_FDCWD, path, 0));
}

}  // extern "C"
