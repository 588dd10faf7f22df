// README's chapter "Doors", command by command as it is written: from nothing to a trainee who drills and an instructor
// who watches, by certificates. Only the port is another one, which the system chooses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/stage.hpp"
#include "tests/support/authentication/proxy.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

// The shell's lines of a chapter, which are those that begin with four blanks.
std::vector<std::string> shell_lines(const std::string& chapter) {
  std::ifstream readme(source_dir() / "README.md");
  std::vector<std::string> lines;
  bool within = false;
  for (std::string line; std::getline(readme, line);) {
    if (line.starts_with("## ")) within = line == "## " + chapter;
    if (within && line.starts_with("    ")) lines.push_back(line.substr(4));
  }
  return lines;
}

struct Script {
  std::string commands;              // what a shell is given
  std::vector<std::string> answers;  // what the console answers, by the page
};

// The program of the line before runs beside, and is told each typed line until it answers "ok": whoever types waits
// until the others are there.
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

// Lines that begin with "> " are typed into the program before them, and those between are its answers.
Script script_of(const std::vector<std::string>& lines) {
  Script script{.commands = kType, .answers = {}};
  bool typing = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    const bool is_typed = line.starts_with("> ");
    if (!is_typed && i + 1 < lines.size() && lines[i + 1].starts_with("> ") && !typing) {
      script.commands += "coproc CONSOLE { " + line + "; }\n";
    } else if (is_typed) {
      script.commands += "type_line '" + line.substr(2) + "'\n";
    } else if (typing && line.starts_with("ok")) {
      script.answers.push_back(line);
      continue;
    } else {
      script.commands += line + "\n";
    }
    typing = is_typed;
  }
  return script;
}

// An answer with the same number in the place of each of its numbers, since a hand may have cut by then, and its parts
// in order, since either may come first.
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

enum class Start { server, server_and_proxy };

class ReadmeDoors : public ::testing::TestWithParam<Start> {};

TEST_P(ReadmeDoors, LeadFromNothingToATraineeAndAnInstructor) {
  const bool with_proxy = GetParam() == Start::server_and_proxy;
  if (const std::string missing = Proxy::missing(); with_proxy && !missing.empty()) GTEST_SKIP() << missing;
  std::vector<std::string> lines = shell_lines("Doors");
  const auto serves = [](const std::string& line) { return line.starts_with("deploy/serve "); };
  const auto proxy = std::ranges::find_if(lines, serves);
  const auto server =
      std::ranges::find_if(lines, [](const std::string& line) { return line.find(" --listen ") != std::string::npos; });
  ASSERT_NE(proxy, lines.end()) << "README starts no proxy";
  ASSERT_NE(server, lines.end()) << "README starts no server";
  // The page says that the one stands in place of the other.
  if (with_proxy) *server = *proxy;
  lines.erase(proxy);
  const Script script = script_of(lines);
  ASSERT_EQ(script.answers.size(), 6u);

  const TempDir folder;
  std::filesystem::create_symlink(source_dir() / "deploy", folder / "deploy");
  std::filesystem::create_directories(folder / "build" / "dev");
  std::filesystem::create_symlink(program("osteon-server").parent_path(), folder / "build" / "dev" / "bin");
  const std::string port = std::to_string(free_port());
  std::ofstream(folder / "commands.sh") << "set -euo pipefail\n" << replaced(script.commands, "50443", port);
  ProcessOptions options;
  options.folder = folder.path();
  options.environment = {{"OSTEON_SERVER", program("osteon-server")}, {"XDG_CACHE_HOME", folder / "cache"}};
  const RunResult done = run("bash", {folder / "commands.sh"}, 120s, options);
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

INSTANTIATE_TEST_SUITE_P(Both, ReadmeDoors, testing::Values(Start::server, Start::server_and_proxy),
                         [](const auto& one) { return one.param == Start::server ? "Server" : "ServerAndProxy"; });

}  // namespace
}  // namespace osteon::test
