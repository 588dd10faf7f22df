#include "server/import/isolated_reader.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <type_traits>

namespace osteon::import {
namespace {

constexpr int kPollMilliseconds = 20;

// What the child tells: which file it opens, how far it is, and at last a scan or an error.
enum class Record : char { file, progress, scan, error };

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

template <class T>
void put(int descriptor, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (!write_all(descriptor, &value, sizeof value)) ::_exit(1);
}

void put(int descriptor, const std::string& text) {
  put(descriptor, text.size());
  if (!write_all(descriptor, text.data(), text.size())) ::_exit(1);
}

// Matrices of fixed size are plain numbers in memory.
template <class Matrix>
void put_matrix(int descriptor, const Matrix& m) {
  for (Eigen::Index i = 0; i < m.size(); ++i) put(descriptor, m.data()[i]);
}

[[noreturn]] void run_child(const ScanReader& reader, int out) {
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDERR_FILENO);
  ::dup2(nowhere, STDOUT_FILENO);
  const auto at_file = [out](const std::filesystem::path& file) {
    put(out, Record::file);
    put(out, file.string());
  };
  const auto progress = [out](double fraction) {
    put(out, Record::progress);
    put(out, fraction);
    return true;  // the parent ends this process when the user wants it stopped
  };
  const Result<CtScan> scan = reader(at_file, progress);
  if (!scan) {
    put(out, Record::error);
    put(out, scan.error().code);
    put(out, scan.error().message);
    ::_exit(0);
  }
  put(out, Record::scan);
  put(out, scan->source);
  put(out, scan->volume.dims);
  put_matrix(out, scan->volume.spacing_mm);
  put_matrix(out, scan->volume.origin_mm);
  put_matrix(out, scan->volume.directions);
  if (!write_all(out, scan->volume.values.data(), scan->volume.values.size() * sizeof(std::int16_t))) ::_exit(1);
  ::_exit(0);
}

// The parent's end. Reading fails for good when the child is gone or the user wants to stop.
class Line {
 public:
  Line(int descriptor, const KeepGoing& keep_going) : descriptor_(descriptor), keep_going_(keep_going) {}

  bool ask() {
    stopped = stopped || !keep_going_(fraction);
    return !stopped;
  }
  bool get(void* data, std::size_t size) {
    char* to = static_cast<char*>(data);
    while (size > 0) {
      pollfd ready{descriptor_, POLLIN, 0};
      const int events = ::poll(&ready, 1, kPollMilliseconds);
      if (events <= 0 || size > (1u << 20)) {
        if (!ask()) return false;
        if (events <= 0) continue;
      }
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
  bool get(std::string& text) {
    std::size_t size = 0;
    if (!get(size)) return false;
    text.resize(size);
    return get(text.data(), size);
  }
  template <class Matrix>
  bool get_matrix(Matrix& m) {
    return get(m.data(), static_cast<std::size_t>(m.size()) * sizeof *m.data());
  }

  double fraction = 0.0;
  bool stopped = false;

 private:
  int descriptor_;
  const KeepGoing& keep_going_;
};

bool get_scan(Line& line, CtScan& scan) {
  imaging::HuVolume& v = scan.volume;
  if (!line.get(scan.source) || !line.get(v.dims) || !line.get_matrix(v.spacing_mm) || !line.get_matrix(v.origin_mm) || !line.get_matrix(v.directions))
    return false;
  v.values.resize(v.count());
  return line.get(v.values.data(), v.values.size() * sizeof(std::int16_t));
}

Result<CtScan> listen(Line& line) {
  std::string file = "the input";
  Record record{};
  while (line.get(record)) {
    if (record == Record::file) {
      if (!line.get(file)) break;
    } else if (record == Record::progress) {
      if (!line.get(line.fraction)) break;
      if (!line.ask()) break;
    } else if (record == Record::scan) {
      CtScan scan;
      if (!get_scan(line, scan)) break;
      return scan;
    } else {
      Error error;
      if (!line.get(error.code) || !line.get(error.message)) break;
      return tl::unexpected(error);
    }
  }
  if (line.stopped) return failure(ErrorCode::cancelled, "stopped while reading the scan");
  return failure(ErrorCode::invalid_input, file + " is damaged so that it cannot be read; copy or export it again");
}

}  // namespace

Result<CtScan> read_isolated(const ScanReader& reader, const KeepGoing& keep_going) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return failure(ErrorCode::internal, std::string("cannot make a pipe: ") + std::strerror(errno));
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    return failure(ErrorCode::internal, std::string("cannot start the reader: ") + std::strerror(errno));
  }
  if (child == 0) {
    ::close(ends[0]);
    run_child(reader, ends[1]);
  }
  ::close(ends[1]);
  Line line(ends[0], keep_going);
  Result<CtScan> result = listen(line);
  ::close(ends[0]);
  ::kill(child, SIGKILL);  // it has said everything, or is not wanted any more
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return result;
}

}  // namespace osteon::import
