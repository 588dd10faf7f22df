#include "tests/support/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

#include "common/core/check.hpp"
#include "tests/support/wait.hpp"

extern char** environ;

namespace osteon::test {
namespace {

constexpr int kCannotStart = 127;

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    OSTEON_CHECK(::pipe2(ends, O_CLOEXEC) == 0);
    read = ends[0];
    write = ends[1];
  }
};

void close_once(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

std::vector<std::string> child_environment(const ProcessOptions& options) {
  std::map<std::string, std::string> variables;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    const auto equals = text.find('=');
    if (equals != text.npos) variables[std::string(text.substr(0, equals))] = text.substr(equals + 1);
  }
  for (const auto& name : options.without) variables.erase(name);
  for (const auto& [name, value] : options.environment) variables[name] = value;
  std::vector<std::string> entries;
  for (const auto& [name, value] : variables) entries.push_back(name + "=" + value);
  return entries;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (auto& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

struct Process::State {
  pid_t pid = -1;
  int input = -1, output = -1, errors = -1;
  std::optional<int> exit_code;
  std::size_t read_to = 0;   // of standard output, by read_line
  mutable std::mutex mutex;  // guards out and err
  std::string out, err;
  std::atomic<bool> ended = false;
  std::thread reader;

  // Reads both outputs until they are closed, or until they are empty after the child's end. Processes that the child
  // started may still hold them open.
  void read_outputs() {
    pollfd polled[2] = {{output, POLLIN, 0}, {errors, POLLIN, 0}};
    char buffer[65536];
    while (polled[0].fd >= 0 || polled[1].fd >= 0) {
      const bool last = ended;
      const int ready = ::poll(polled, 2, last ? 0 : 20);
      if (ready < 0 && errno != EINTR) return;
      if (ready <= 0) {
        if (last) return;
        continue;
      }
      for (int i = 0; i < 2; ++i) {
        if (polled[i].fd < 0 || polled[i].revents == 0) continue;
        const ssize_t got = ::read(polled[i].fd, buffer, sizeof buffer);
        if (got > 0) {
          const std::lock_guard lock(mutex);
          (i == 0 ? out : err).append(buffer, static_cast<std::size_t>(got));
        } else if (got == 0 || errno != EINTR) {
          polled[i].fd = -1;
        }
      }
    }
  }

  void note_exit(int status) {
    exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    close_once(input);
    ended = true;
    if (reader.joinable()) reader.join();
    close_once(output);
    close_once(errors);
  }
};

Process::Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 ProcessOptions options)
    : state_(std::make_unique<State>()) {
  std::vector<std::string> argument_texts{program.string()};
  argument_texts.insert(argument_texts.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment_texts = child_environment(options);
  const std::vector<char*> argv = pointers(argument_texts), envp = pointers(environment_texts);
  const std::string folder = options.folder.string();
  Pipe in, out, err;

  const pid_t pid = ::fork();
  OSTEON_CHECK(pid >= 0);
  if (pid == 0) {                        // only async-signal-safe calls from here on
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // if a test crashes, its programs end too
    ::dup2(in.read, STDIN_FILENO);
    ::dup2(out.write, STDOUT_FILENO);
    ::dup2(err.write, STDERR_FILENO);
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    // A program inherits which signals are ignored. `nohup deploy/test &` has the first three ignored.
    for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGPIPE}) ::signal(number, SIG_DFL);
    if (folder.empty() || ::chdir(folder.c_str()) == 0) ::execvpe(argv[0], argv.data(), envp.data());
    ::_exit(kCannotStart);
  }
  ::close(in.read);
  ::close(out.write);
  ::close(err.write);
  state_->pid = pid;
  state_->input = in.write;
  state_->output = out.read;
  state_->errors = err.read;
  state_->reader = std::thread([state = state_.get()] { state->read_outputs(); });
}

Process::Process(Process&&) noexcept = default;
Process& Process::operator=(Process&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}

Process::~Process() {
  if (!state_ || !running()) return;
  if (terminate(std::chrono::seconds{2})) return;
  signal(SIGKILL);
  int status = 0;
  while (::waitpid(state_->pid, &status, 0) < 0 && errno == EINTR) {
  }
  state_->note_exit(status);
}

pid_t Process::pid() const { return state_->pid; }

bool Process::running() {
  if (state_->exit_code) return false;
  int status = 0;
  if (::waitpid(state_->pid, &status, WNOHANG) != state_->pid) return true;
  state_->note_exit(status);
  return false;
}

void Process::signal(int number) {
  if (!state_->exit_code) ::kill(state_->pid, number);
}

std::optional<int> Process::wait(std::chrono::milliseconds patience) {
  if (wait_until([&] { return !running(); }, patience)) return state_->exit_code;
  return std::nullopt;
}

std::optional<int> Process::terminate(std::chrono::milliseconds patience) {
  signal(SIGTERM);
  return wait(patience);
}

std::string Process::out() const {
  const std::lock_guard lock(state_->mutex);
  return state_->out;
}

std::string Process::err() const {
  const std::lock_guard lock(state_->mutex);
  return state_->err;
}

bool Process::wait_for_out(std::string_view text, std::chrono::milliseconds patience) {
  return wait_until([&] { return out().find(text) != std::string::npos || !running(); }, patience) &&
         out().find(text) != std::string::npos;
}

bool Process::wait_for_percent(int percent, std::chrono::milliseconds patience) {
  const auto reached = [&] {
    const std::string text = err();
    const auto sign = text.rfind(" %");
    if (sign == std::string::npos) return false;
    const auto before = text.find_last_not_of("0123456789", sign - 1);
    return std::atoi(text.c_str() + before + 1) >= percent;
  };
  return wait_until([&] { return reached() || !running(); }, patience) && running();
}

std::optional<std::string> Process::read_line(std::chrono::milliseconds patience) {
  std::optional<std::string> line;
  const auto take = [&] {
    const std::lock_guard lock(state_->mutex);
    const auto end = state_->out.find('\n', state_->read_to);
    if (end == std::string::npos) return false;
    line = state_->out.substr(state_->read_to, end - state_->read_to);
    state_->read_to = end + 1;
    return true;
  };
  if (!wait_until([&] { return take() || !running(); }, patience)) return std::nullopt;
  if (!line) take();  // output that the child wrote just before it ended
  return line;
}

void Process::write(std::string_view text) {
  // A child that has ended must fail the test by its exit code. It must not end the test by SIGPIPE.
  static const auto ignored = ::signal(SIGPIPE, SIG_IGN);
  static_cast<void>(ignored);
  while (!text.empty() && state_->input >= 0) {
    const ssize_t put = ::write(state_->input, text.data(), text.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return;
    text.remove_prefix(static_cast<std::size_t>(put));
  }
}

void Process::close_input() { close_once(state_->input); }

RunResult run(const std::filesystem::path& program, const std::vector<std::string>& arguments,
              std::chrono::milliseconds patience, ProcessOptions options) {
  Process process(program, arguments, std::move(options));
  process.close_input();
  RunResult result;
  auto code = process.wait(patience);
  if (!code) {
    result.timed_out = true;
    process.signal(SIGKILL);
    code = process.wait(std::chrono::seconds{10});
  }
  result.exit_code = code.value_or(-1);
  result.out = process.out();
  result.err = process.err();
  return result;
}

std::filesystem::path program(std::string_view name) {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
}

}  // namespace osteon::test
