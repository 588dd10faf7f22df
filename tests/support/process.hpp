// A real program as a child of a test. Its output is captured. It ends with the scope, by its own process id.
#pragma once
#include <sys/types.h>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace osteon::test {

struct ProcessOptions {
  std::vector<std::pair<std::string, std::string>> environment;  // set on top of the test's own
  std::vector<std::string> without;                              // variables that the child must not see
  std::filesystem::path folder;                                  // working folder; empty: the test's own
};

class Process {
 public:
  // `program`: a path, or a bare name to be found in PATH. Exit code 127 if it cannot be started.
  Process(const std::filesystem::path& program, const std::vector<std::string>& arguments, ProcessOptions options = {});
  ~Process();  // SIGTERM, and SIGKILL after two seconds
  Process(Process&&) noexcept;
  Process& operator=(Process&&) noexcept;

  [[nodiscard]] pid_t pid() const;
  [[nodiscard]] bool running();
  void signal(int number);
  // The exit code; 128 + signal if a signal ended it. Empty if it still runs after `patience`.
  [[nodiscard]] std::optional<int> wait(std::chrono::milliseconds patience);
  // Sends SIGTERM, then waits.
  [[nodiscard]] std::optional<int> terminate(std::chrono::milliseconds patience = std::chrono::seconds{10});

  // The output so far. Complete after wait() returned an exit code.
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  // True as soon as standard output contains `text`.
  [[nodiscard]] bool wait_for_out(std::string_view text, std::chrono::milliseconds patience);
  // True as soon as the last progress on standard error is at least `percent`. False if the program ends, or patience
  // does, before that.
  [[nodiscard]] bool wait_for_percent(int percent, std::chrono::milliseconds patience);
  // The next whole line of standard output, without its line end.
  [[nodiscard]] std::optional<std::string> read_line(std::chrono::milliseconds patience);
  void write(std::string_view text);  // to standard input
  void close_input();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct RunResult {
  int exit_code = -1;
  bool timed_out = false;  // killed because it ran longer than allowed
  std::string out, err;
};
// Runs the program to its end, with an empty standard input.
[[nodiscard]] RunResult run(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                            std::chrono::milliseconds patience = std::chrono::seconds{60}, ProcessOptions options = {});

// One of this build's programs, e.g. "osteon-server". It is in the folder of the running test.
[[nodiscard]] std::filesystem::path program(std::string_view name);

}  // namespace osteon::test
