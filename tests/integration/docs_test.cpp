// Runs the shell commands of the documentation as they are written, each page from an empty folder. Only the ports
// differ: the system chooses them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/integration/stage.hpp"
#include "tests/support/authentication/proxy.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/xvfb.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

// A page takes less than a minute. Only programs that hang reach this limit, also on a busy machine.
constexpr auto kUntilHung = 540s;

// A fenced block of a page: its first line, and its other lines.
struct Block {
  std::string language, file;
  std::vector<std::string> lines;
};

std::vector<Block> blocks_of(const std::string& page) {
  std::ifstream in(source_dir() / page);
  std::vector<Block> blocks;
  const std::regex fence("^( *)```(\\S*) *(\\S*)$");
  std::size_t indent = 0;
  bool within = false;
  for (std::string line; std::getline(in, line);) {
    std::smatch found;
    if (std::regex_match(line, found, fence)) {
      within = !within;
      indent = found[1].length();
      if (within) blocks.push_back({.language = found[2], .file = found[3], .lines = {}});
    } else if (within) {
      blocks.back().lines.push_back(line.substr(std::min(indent, line.size())));
    }
  }
  return blocks;
}

struct Script {
  std::string commands;              // input of a shell
  std::vector<std::string> answers;  // answers of the console, by the page
};

// Runs the program of the line before beside the script. Repeats each typed line until the program answers "ok", as a
// person would wait until the others are there.
constexpr const char* kType = R"(
type_line() {
  local answer=
  until [[ $answer == ok* ]]; do
    [[ -z $answer ]] || sleep 0.1
    echo "$1" >&"${CONSOLE[1]}"
    read -r answer <&"${CONSOLE[0]}"
  done
  echo "$answer"
}
)";

// Appends a block of a console: a command, then typed lines that begin with "> ", each followed by its answer.
void add_console(const Block& block, Script& script) {
  std::string program;
  for (const std::string& line : block.lines) {
    if (!line.starts_with("> ") && script.answers.empty() && !line.starts_with("ok")) {
      program += line + "\n";
      continue;
    }
    if (!program.empty()) {
      program.pop_back();
      script.commands += "coproc CONSOLE { " + std::exchange(program, "") + "; }\n";
    }
    if (line.starts_with("> "))
      script.commands += "type_line '" + line.substr(2) + "'\n";
    else
      script.answers.push_back(line);
  }
}

// Makes answers comparable. All numbers become the same number, because a hand may have cut by then. The parts are
// sorted, because either may come first.
std::string without_chance(const std::string& answer) {
  std::istringstream all(
      std::regex_replace(std::regex_replace(answer, std::regex("[0-9]+"), "N"), std::regex(": "), ";"));
  std::vector<std::string> parts;
  for (std::string part; std::getline(all, part, ';');)
    parts.push_back(part.substr(std::min(part.size(), part.find_first_not_of(' '))));
  std::ranges::sort(parts);
  std::string text;
  for (const std::string& part : parts) text += part + ";";
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

// Commands that install services need root.
bool is_for_root(const std::string& line) { return line.starts_with("cp ") || line.starts_with("systemctl "); }

// Commands that build or run everything. CI does that with each change. integration.help makes the man pages, which
// starts each program a dozen times.
bool runs_elsewhere(const std::string& line) {
  return std::ranges::any_of(
      std::initializer_list<std::string>{"deploy/demo", "deploy/test", "deploy/build", "deploy/man"},
      [&](const std::string& command) { return line.starts_with(command); });
}

// Makes a folder with the links that the commands expect.
void prepare(const TempDir& folder) {
  std::filesystem::create_symlink(source_dir() / "deploy", folder / "deploy");
  std::filesystem::create_symlink(source_dir() / "common", folder / "common");
  std::filesystem::create_directories(folder / "build" / "dev");
  std::filesystem::create_symlink(program("osteon-server").parent_path(), folder / "build" / "dev" / "bin");
}

enum class Start { server, server_and_proxy };

class SecurityPage : public ::testing::TestWithParam<Start> {};

TEST_P(SecurityPage, LeadsFromNothingToATraineeAndAnInstructor) {
  const bool with_proxy = GetParam() == Start::server_and_proxy;
  if (const std::string missing = Proxy::missing(); with_proxy && !missing.empty()) GTEST_SKIP() << missing;
  std::string serve;
  Script script{.commands = kType, .answers = {}};
  for (const Block& block : blocks_of("deploy/docs/security.md")) {
    if (block.language == "console") add_console(block, script);
    if (block.language != "sh") continue;
    for (const std::string& line : block.lines) {
      if (line.starts_with("deploy/serve ")) serve = line;
      if (line.starts_with("deploy/serve ") || is_for_root(line)) continue;
      script.commands += line + "\n";
    }
  }
  ASSERT_EQ(script.answers.size(), 6u);
  ASSERT_FALSE(serve.empty()) << "the page starts no proxy";
  // The page says that the proxy replaces the server's address.
  const std::regex server("[^\\n]* --listen [^\\n]*");
  ASSERT_TRUE(std::regex_search(script.commands, server)) << "the page starts no server";
  if (with_proxy) script.commands = std::regex_replace(script.commands, server, serve);

  const TempDir folder;
  prepare(folder);
  const std::string port = std::to_string(free_port());
  std::ofstream(folder / "commands.sh") << "set -euo pipefail\n" << replaced(script.commands, "50443", port);
  ProcessOptions options;
  options.folder = folder.path();
  options.environment = {{"OSTEON_SERVER", program("osteon-server")}, {"XDG_CACHE_HOME", folder / "cache"}};
  const RunResult done = run("bash", {folder / "commands.sh"}, kUntilHung, options);
  ASSERT_EQ(done.exit_code, 0) << done.out << done.err;

  std::istringstream said(done.out);
  std::size_t answered = 0;
  for (std::string line; std::getline(said, line) && answered < script.answers.size();) {
    if (!line.starts_with("ok")) continue;
    EXPECT_EQ(without_chance(line), without_chance(script.answers[answered]));
    ++answered;
  }
  EXPECT_EQ(answered, script.answers.size()) << done.out << done.err;
  const nlohmann::json drilled = read_json(folder / "drilled.json");
  EXPECT_EQ(drilled["steps"][0]["completed"], true) << drilled;
  EXPECT_GT(drilled["cuts"], 0);
  EXPECT_EQ(drilled["lost"], nullptr);
  EXPECT_TRUE(std::filesystem::exists(folder / "my-rooms" / "ward.journal"));
  std::ifstream list(folder / "certs" / "server" / "access.txt");
  EXPECT_THAT(std::string(std::istreambuf_iterator<char>(list), {}), HasSubstr("revoke certificate"));
  if (with_proxy) {
    EXPECT_THAT(done.err, HasSubstr("clients come to localhost:" + port));
  }
}

INSTANTIATE_TEST_SUITE_P(Both, SecurityPage, testing::Values(Start::server, Start::server_and_proxy),
                         [](const auto& one) { return one.param == Start::server ? "Server" : "ServerAndProxy"; });

// Files that a reader has: a scan, a mesh and labelled slices. The scan is coarse, because the pages import it again
// and again.
constexpr const char* kInputs = R"(
build/dev/bin/osteon-import phantom block --layers 5:1.9,20:0.3,5:1.9 --width 40 --pitch 1 --out scanned \
  --dicom MY_CD
build/dev/bin/osteon-import surface scanned --out femur.stl
mkdir SLICES
"$OSTEON_PYTHON" - <<'END'
import matplotlib.image
import numpy as np
for number in range(30):
    slice = np.zeros((30, 30, 3), np.uint8)
    if 5 < number < 25:
        slice[6:24, 6:24] = 255, 249, 219
    matplotlib.image.imsave(f"SLICES/slice{number}.png", slice)
END
)";

class Pages : public ::testing::TestWithParam<const char*> {
 protected:
  // Made once for all pages.
  static void SetUpTestSuite() {
    inputs_ = std::make_unique<TempDir>();
    prepare(*inputs_);
    std::ofstream(*inputs_ / "inputs.sh") << "set -euo pipefail\n" << kInputs;
    ProcessOptions options;
    options.folder = inputs_->path();
    options.environment = {{"OSTEON_PYTHON", OSTEON_PYTHON}};
    const RunResult made = run("bash", {*inputs_ / "inputs.sh"}, kUntilHung, options);
    ASSERT_EQ(made.exit_code, 0) << made.out << made.err;
  }
  static void TearDownTestSuite() { inputs_.reset(); }
  static void copy_inputs(const TempDir& to) {
    for (const char* name : {"scanned", "MY_CD", "femur.stl", "SLICES"})
      std::filesystem::copy(*inputs_ / name, to / name, std::filesystem::copy_options::recursive);
  }

 private:
  static std::unique_ptr<TempDir> inputs_;
};
std::unique_ptr<TempDir> Pages::inputs_;

TEST_P(Pages, RunFromAnEmptyFolder) {
  const auto screen = Xvfb::start();
  ASSERT_TRUE(screen) << "Xvfb does not start; deploy/install installs it";
  const TempDir folder;
  prepare(folder);
  copy_inputs(folder);
  const std::string port = std::to_string(free_port());
  std::string commands = "set -euo pipefail\n";
  int count = 0;
  for (const Block& block : blocks_of(GetParam())) {
    std::string text;
    for (const std::string& line : block.lines) {
      if (runs_elsewhere(line)) {
        EXPECT_TRUE(std::filesystem::exists(folder / line.substr(0, line.find(' ')))) << line;
        continue;
      }
      text += line + "\n", ++count;
      // A reader goes on when the server has started.
      if (line.starts_with("build/dev/bin/osteon-server ") && line.ends_with("&"))
        text += "until (exec 3<>/dev/tcp/127.0.0.1/50000) 2>/dev/null; do sleep 0.1; done\n";
    }
    text = replaced(text, "50000", port);
    if (!block.file.empty()) std::ofstream(folder / block.file) << text;
    if (block.language == "sh") commands += text;
  }
  ASSERT_GE(count, 3) << "the page has hardly a command";
  // Programs that the page leaves running end with it.
  std::ofstream(folder / "commands.sh") << commands << "kill $(jobs -p) 2>/dev/null || true\nwait\n";
  ProcessOptions options = screen->options();
  options.folder = folder.path();
  options.environment.insert(options.environment.end(), {{"OSTEON_LIBHD", OSTEON_STAND_IN_HD},
                                                         {"OSTEON_PYTHON", OSTEON_PYTHON},
                                                         {"XDG_CACHE_HOME", folder / "cache"},
                                                         {"XDG_CONFIG_HOME", folder / "settings"},
                                                         {"XDG_DATA_HOME", folder / "data"}});
  const RunResult done = run("bash", {folder / "commands.sh"}, kUntilHung, options);
  EXPECT_EQ(done.exit_code, 0) << done.out << done.err;
}

INSTANTIATE_TEST_SUITE_P(All, Pages,
                         testing::Values("README.md", "deploy/docs/guide.md", "deploy/docs/tools.md",
                                         "deploy/docs/haptics.md", "deploy/docs/operate.md",
                                         "deploy/docs/subvolumes.md"),
                         [](const auto& one) {
                           std::string name = std::filesystem::path(one.param).stem().string();
                           name[0] = static_cast<char>(std::toupper(name[0]));
                           return name;
                         });

}  // namespace
}  // namespace osteon::test
