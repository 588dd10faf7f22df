#include "tests/support/relay/impair_process.hpp"

#include <fstream>

#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

std::vector<std::string> with_addresses(std::vector<std::string> arguments, const std::filesystem::path& file) {
  arguments.insert(arguments.end(), {"--addresses", file.string()});
  return arguments;
}

}  // namespace

ImpairProcess::ImpairProcess(std::vector<std::string> arguments)
    : process_(program("osteon-impair"), with_addresses(std::move(arguments), folder_ / "addresses")) {
  if (!wait_for_file(folder_ / "addresses", std::chrono::seconds{10})) return;
  std::ifstream in(folder_ / "addresses");
  for (std::string line; std::getline(in, line);) addresses_.push_back(line);
}

std::string ImpairProcess::address(const std::string& kind, std::size_t n) const {
  for (const std::string& line : addresses_)
    if (line.starts_with(kind) && n-- == 0) return line.substr(kind.size());
  return {};
}

std::string ImpairProcess::command(const std::string& line) {
  process_.write(line + "\n");
  return process_.read_line(std::chrono::seconds{10}).value_or("no answer");
}

}  // namespace osteon::test
