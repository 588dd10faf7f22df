// Runs all programs of a room as real processes on this machine, for tests that watch them from outside.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/xvfb.hpp"

namespace osteon::test {

// A CSV file with a header line: columns by name. Cells that are not numbers become `not a number`.
struct Table {
  std::map<std::string, std::vector<double>> columns;
  std::map<std::string, std::vector<std::string>> texts;
  [[nodiscard]] std::size_t entries() const { return texts.empty() ? 0 : texts.begin()->second.size(); }
  [[nodiscard]] const std::vector<double>& operator[](const std::string& name) const { return columns.at(name); }
};
[[nodiscard]] Table read_table(const std::filesystem::path& file);
[[nodiscard]] nlohmann::json read_json(const std::filesystem::path& file);

// A viewer that is controlled by lines of commands.
class ScriptedViewer {
 public:
  ScriptedViewer(const std::string& address, const Xvfb& screen, std::vector<std::string> more = {});
  // Sends a command and waits for the answering line. Empty if none comes.
  [[nodiscard]] std::string ask(const std::string& command,
                                std::chrono::milliseconds patience = std::chrono::seconds{60});
  // Does the same. True if the answer begins with "ok".
  [[nodiscard]] bool tell(const std::string& command, std::chrono::milliseconds patience = std::chrono::seconds{60});
  [[nodiscard]] Process& process() { return process_; }

 private:
  Process process_;
};

class Stage {
 public:
  // Imports the layered block (5, 20, 5 mm) and starts a server on it.
  explicit Stage(double width_mm = 40.0, std::vector<std::string> server_arguments = {});
  // Does the same with a case that `make_case` writes to the given folder.
  explicit Stage(const std::function<void(const std::filesystem::path&)>& make_case,
                 std::vector<std::string> server_arguments = {});

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return temp_ / name; }
  [[nodiscard]] Process& server() { return *server_; }
  // Starts another server on the same case after the first has ended. The stage's address changes to the new server's.
  void start_server(std::vector<std::string> more);
  [[nodiscard]] Process start(const std::string& name, std::vector<std::string> arguments,
                              ProcessOptions options = {}) const;
  // Starts a haptic client that carries out a plan and leaves NAME.csv, NAME-cuts.csv and NAME.json. It runs for a
  // named person or for an unknown one.
  [[nodiscard]] Process start_haptic(const std::string& name, const nlohmann::json& plan,
                                     const std::string& person = {}) const;

 private:
  TempDir temp_;
  std::unique_ptr<Process> server_;
  std::string address_;
};

// A step that drills along −z through the block at (x, y).
[[nodiscard]] nlohmann::json drill_at(double x_mm, double y_mm, const std::string& hand);

}  // namespace osteon::test
