#include "server/import/isolated_reader.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <type_traits>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define OSTEON_SANITIZED 1
#elif defined(__has_feature)
#define OSTEON_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#else
#define OSTEON_SANITIZED 0
#endif

namespace osteon::import {
namespace {

constexpr int kPollMilliseconds = 20;
constexpr int kPatienceMilliseconds = 120'000;  // counts polls without data, so a suspended process loses no time
constexpr int kPipe_bytes = 1 << 20;            // a slice of 512 x 512 at once
constexpr std::size_t kLargestMessage = std::size_t{1} << 30;  // a slice of 16384 x 16384 is half of it

// The child's messages: the file that it opens, its progress, a part of the result, and finally how it ended.
enum class Record : char { file, progress, message, done, error };

template <class T>
void put(int descriptor, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (!write_all(descriptor, &value, sizeof value)) ::_exit(1);
}

void put_text(int descriptor, std::string_view text) {
  put(descriptor, text.size());
  if (!write_all(descriptor, text.data(), text.size())) ::_exit(1);
}

// A length that a damaged file claims must not use up the machine's memory. Sanitizers reserve far more than they use.
void limit_memory([[maybe_unused]] std::size_t more_bytes) {
#if !OSTEON_SANITIZED
  unsigned long pages = 0;
  if (std::FILE* status = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(status, "%lu", &pages) != 1) pages = 0;
    std::fclose(status);
  }
  if (pages == 0) return;
  const rlim_t bytes = static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + more_bytes;
  const rlimit limit{bytes, bytes};
  ::setrlimit(RLIMIT_AS, &limit);
#endif
}

Result<void> run_guarded(const IsolatedWork& work, ChildChannel& channel) try {
  return work.run(channel);
} catch (const std::bad_alloc&) {
  ::_exit(1);  // as if it had died: the parent knows the file
} catch (const std::exception& error) {
  return failure(ErrorCode::internal, std::string("reading the input failed: ") + error.what());
}

[[noreturn]] void run_child(const IsolatedWork& work, int out, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDERR_FILENO);
  ::dup2(nowhere, STDOUT_FILENO);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  limit_memory(work.memory_bytes);
  ChildChannel channel(out);
  const Result<void> result = run_guarded(work, channel);
  if (result) {
    put(out, Record::done);
  } else {
    put(out, Record::error);
    put(out, result.error().code);
    put_text(out, result.error().message);
  }
  ::_exit(0);
}

// The parent's end of the pipe. Once the child is gone or silent, or the user wants to stop, every read fails.
class Line {
 public:
  Line(int descriptor, const KeepGoing& keep_going) : descriptor_(descriptor), keep_going_(keep_going) {}

  bool ask() {
    stopped = stopped || !keep_going_(fraction);
    return !stopped;
  }
  bool get(void* data, std::size_t size) {
    char* to = static_cast<char*>(data);
    int silent_ms = 0;
    while (size > 0) {
      pollfd ready{descriptor_, POLLIN, 0};
      const int events = ::poll(&ready, 1, kPollMilliseconds);
      if (events <= 0) {
        silent_ms += kPollMilliseconds;
        if (!ask() || silent_ms > kPatienceMilliseconds) return false;
        continue;
      }
      silent_ms = 0;
      const ssize_t n = ::read(descriptor_, to, size);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      to += n;
      size -= static_cast<std::size_t>(n);
    }
    return true;
  }
  template <class T>
  bool get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return get(&value, sizeof value);
  }
  bool get_text(std::string& text) {
    std::size_t size = 0;
    if (!get(size) || size > kLargestMessage) return false;
    text.resize(size);
    return get(text.data(), size);
  }

  double fraction = 0.0;
  bool stopped = false;

 private:
  int descriptor_;
  const KeepGoing& keep_going_;
};

IsolatedEnd listen(Line& line, const IsolatedWork& work) {
  IsolatedEnd end;
  Record record{};
  std::string message;
  while (line.get(record)) {
    if (record == Record::done) return end;
    if (record == Record::error) {
      Error error;
      if (!line.get(error.code) || !line.get_text(error.message)) break;
      end.result = tl::unexpected(error);
      return end;
    }
    if (record == Record::file) {
      std::size_t file = 0;
      if (!line.get(file)) break;
      end.file = file;
    } else if (record == Record::progress) {
      if (!line.get(line.fraction) || !line.ask()) break;
    } else if (!line.get_text(message) || !work.on_message(message)) {
      break;
    }
  }
  if (line.stopped) {
    end.result = stopped_while("reading the scan");
  } else {
    end.died = true;
    end.result =
        failure(ErrorCode::invalid_input, "the input is damaged so that it cannot be read; copy or export it again");
  }
  return end;
}

}  // namespace

bool write_all(int descriptor, const void* data, std::size_t size) {
  const char* from = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t n = ::write(descriptor, from, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    from += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool limits_memory() { return !OSTEON_SANITIZED; }

void ChildChannel::at_file(std::size_t file) {
  put(descriptor_, Record::file);
  put(descriptor_, file);
}

void ChildChannel::progress(double fraction) {
  put(descriptor_, Record::progress);
  put(descriptor_, fraction);
}

void ChildChannel::send(std::string_view message) {
  put(descriptor_, Record::message);
  put_text(descriptor_, message);
}

IsolatedEnd run_isolated(const IsolatedWork& work, const KeepGoing& keep_going) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    return {.result = failure(ErrorCode::internal, std::string("cannot make a pipe: ") + std::strerror(errno)),
            .died = false,
            .file = {}};
  ::fcntl(ends[1], F_SETPIPE_SZ, kPipe_bytes);  // refused for a user with many pipes: it is slower then
  std::fflush(nullptr);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    return {.result = failure(ErrorCode::internal, std::string("cannot start the reader: ") + std::strerror(errno)),
            .died = false,
            .file = {}};
  }
  if (child == 0) {
    ::close(ends[0]);
    run_child(work, ends[1], parent);
  }
  ::close(ends[1]);
  Line line(ends[0], keep_going);
  IsolatedEnd end = listen(line, work);
  ::close(ends[0]);
  ::kill(child, SIGKILL);  // it has sent everything, or is no longer wanted
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return end;
}

}  // namespace osteon::import
