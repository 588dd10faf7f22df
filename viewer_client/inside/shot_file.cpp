#include "viewer_client/inside/shot_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

#include "common/runtime/files.hpp"

namespace osteon {
namespace {

// A file that is open for appending.
class AppendedFile {
 public:
  explicit AppendedFile(const std::filesystem::path& file)
      : fd_(::open(file.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0600)) {
    struct stat about {};
    if (fd_ < 0 || ::fstat(fd_, &about) != 0)
      reason_ = errno;
    else if (!S_ISREG(about.st_mode))
      reason_ = EINVAL;
    size_ = about.st_size;
  }
  ~AppendedFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  AppendedFile(const AppendedFile&) = delete;
  AppendedFile& operator=(const AppendedFile&) = delete;

  [[nodiscard]] int reason() const { return reason_; }  // an errno value; 0: all is well
  // Whether the last byte is not the end of a line, as after a crash.
  [[nodiscard]] bool open_line() const {
    char last = '\n';
    return size_ > 0 && ::pread(fd_, &last, 1, size_ - 1) == 1 && last != '\n';
  }
  // All of it, or nothing. Returns an errno value.
  [[nodiscard]] int append(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        const int reason = written < 0 ? errno : ENOSPC;
        // If that fails too, the next line begins after the half one.
        if (::ftruncate(fd_, size_) != 0) return reason;
        return reason;
      }
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
  }

 private:
  int fd_;
  int reason_ = 0;
  off_t size_ = 0;
};

}  // namespace

ShotFile::Kept ShotFile::read() const {
  Kept kept;
  std::error_code ignored;
  if (!std::filesystem::exists(file_, ignored)) return kept;
  const Result<std::string> content = std::filesystem::is_regular_file(file_, ignored)
                                          ? read_file(file_)
                                          : bad_input(file_.string() + " is no file; remove it");
  if (!content) {
    kept.fault = content.error().message + "; the shots of before are not counted";
    return kept;
  }
  std::size_t bad = 0, first_bad = 0, number = 0;
  for (std::string_view rest = *content; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++number;
    if (auto shot = shot_of(line))
      kept.shots.push_back(*shot);
    else if (!line.empty() && bad++ == 0)
      first_bad = number;
  }
  if (bad > 0)
    kept.fault = file_.string() + ": " + (bad == 1 ? "line " : std::to_string(bad) + " lines, the first is line ") +
                 std::to_string(first_bad) + (bad == 1 ? ", is no shot" : ", are no shots") +
                 "; what is there stays, and does not count";
  return kept;
}

Result<void> ShotFile::add(const CArmShot& shot) {
  lines_ += line_of(shot) + '\n';
  ++waiting_;
  Result<void> written = write();
  const bool first = !said_;
  said_ = !written.has_value();
  return written || first ? written : Result<void>();
}

Result<void> ShotFile::catch_up() {
  if (waiting_ == 0) return {};
  Result<void> written = write();
  said_ = !written.has_value();
  return written;
}

Result<void> ShotFile::write() {
  AppendedFile file(file_);
  int reason = file.reason();
  if (reason == 0) reason = file.append(file.open_line() ? "\n" + lines_ : lines_);
  if (reason == 0) {
    lines_.clear();
    waiting_ = 0;
    return {};
  }
  return failure(ErrorCode::internal, "cannot write the shots to " + file_.string() + ": " + std::strerror(reason) +
                                          "; make room on the disk, or they are lost when the session ends");
}

}  // namespace osteon
