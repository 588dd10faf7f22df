#include "server/intake/case_check.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "common/volume/case.hpp"

extern char** environ;

namespace osteon {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostSaid = 64 * 1024;

tl::unexpected<Error> cannot_start(int reason) {
  return failure(ErrorCode::internal, std::string("the process that looks cases through cannot be started: ") + std::strerror(reason));
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int number() const { return number_; }
  void close() {
    ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

// A child that is gone when this is.
class Child {
 public:
  explicit Child(pid_t id) : id_(id) {}
  ~Child() { (void)end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  int end() {
    if (id_ == 0) return status_;
    ::kill(id_, SIGKILL);
    while (::waitpid(id_, &status_, 0) < 0 && errno == EINTR) {
    }
    id_ = 0;
    return status_;
  }
  // Of one that has said everything: it is given a moment to end.
  int join(Clock::time_point until) {
    while (id_ != 0 && ::waitpid(id_, &status_, WNOHANG) == 0) {
      if (Clock::now() > until) return end();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    id_ = 0;
    return status_;
  }
  void limit(int resource, std::uint64_t most) const {
    const rlimit limit{most, most};
    ::prlimit(id_, static_cast<__rlimit_resource>(resource), &limit, nullptr);
  }

 private:
  pid_t id_;
  int status_ = 0;
};

// All that the child says; nothing where it says too much, takes too long or is not wanted any more.
std::optional<std::string> listen(int descriptor, Clock::time_point until, const std::function<bool()>& stop) {
  std::string said;
  std::array<char, 4096> piece{};
  while (said.size() <= kMostSaid) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    if (left.count() <= 0 || (stop && stop())) return {};
    pollfd ready{descriptor, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 1000))) <= 0) continue;
    const ssize_t n = ::read(descriptor, piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return said;
    said.append(piece.data(), static_cast<std::size_t>(n));
  }
  return {};
}

void limit_self(__rlimit_resource resource, std::uint64_t most) {
  const rlimit limit{most, most};
  ::setrlimit(resource, &limit);
}

}  // namespace

Result<CheckedCase> check_case(const fs::path& program, const fs::path& from, const fs::path& to, const IntakeQuota& quota,
                               const std::function<bool()>& stop) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return cannot_start(errno);
  Descriptor in(ends[0]), out(ends[1]);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, out.number(), STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::array<std::string, 4> words{program.string(), "check-case", from.string(), to.string()};
  std::array<char*, 5> arguments{words[0].data(), words[1].data(), words[2].data(), words[3].data(), nullptr};
  pid_t id = 0;
  const int failed = ::posix_spawn(&id, words[0].c_str(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return cannot_start(failed);
  Child child(id);
  out.close();
  // Before it has read a byte of the case, or nearly; what it can do until then is what it can do anyway.
  child.limit(RLIMIT_AS, quota.memory_bytes);
  child.limit(RLIMIT_FSIZE, quota.unpacked_bytes);
  child.limit(RLIMIT_CPU, static_cast<std::uint64_t>(2 * quota.time.count()));

  const std::optional<std::string> said = listen(in.number(), Clock::now() + quota.time, stop);
  if (!said) {
    (void)child.end();
    if (stop && stop()) return failure(ErrorCode::cancelled, "the case is not looked through, since it is not wanted any more");
    return failure(ErrorCode::exhausted, "the case takes longer to read than the " + std::to_string(quota.time.count()) + " s that it may");
  }
  const int status = child.join(Clock::now() + std::chrono::seconds(5));
  const nlohmann::json answer = nlohmann::json::parse(*said, nullptr, false);
  if (answer.is_object() && answer.contains("error") && answer["error"].is_string())
    return failure(ErrorCode::invalid_input, "the case is not sound: " + answer["error"].get<std::string>());
  const bool whole = WIFEXITED(status) && WEXITSTATUS(status) == 0 && answer.is_object() && answer.contains("hash") &&
                     answer["hash"].is_string() && answer.contains("title") && answer["title"].is_string();
  if (!whole && WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGXFSZ))
    return failure(ErrorCode::exhausted, "the case takes more to read than it may");
  if (!whole) return failure(ErrorCode::invalid_input, "the case is damaged so that it cannot be read; import it again");
  const Result<Digest> hash = digest_from_hex(answer["hash"].get<std::string>());
  if (!hash) return tl::unexpected(hash.error());
  return CheckedCase{*hash, answer["title"].get<std::string>()};
}

int run_case_check(const fs::path& from, const fs::path& to) {
  limit_self(RLIMIT_CORE, 0);
  ::prctl(PR_SET_DUMPABLE, 0);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::close_range(3, ~0U, 0);          // whatever the server had open is none of its business
  (void)::unshare(CLONE_NEWNET);     // no network, where the system lets it give that up
  nlohmann::json answer;
  try {
    const Result<Case> read = Case::load(from);
    if (const Result<void> kept = read ? read->save(to) : tl::unexpected(read.error()); !kept)
      answer["error"] = kept.error().message;
    else
      answer = {{"hash", to_hex(read->hash())}, {"title", read->info().title}};
  } catch (const std::exception& broken) {
    answer = {{"error", std::string("it cannot be read: ") + broken.what()}};
  }
  const std::string line = answer.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
  std::fputs(line.c_str(), stdout);
  return answer.contains("error") ? 1 : 0;
}

}  // namespace osteon
