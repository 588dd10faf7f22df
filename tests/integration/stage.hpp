// All programs of a room as real processes on this machine, for tests that watch them from outside.
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

// A CSV file with a header line: columns by name. Cells that are no numbers count as `not a number`.
struct Table {
  std::map<std::string, std::vector<double>> columns;
  std::map<std::string, std::vector<std::string>> texts;
  [[nodiscard]] std::size_t entries() const { return texts.empty() ? 0 : texts.begin()->second.size(); }
  [[nodiscard]] const std::vector<double>& operator[](const std::string& name) const { return columns.at(name); }
};
[[nodiscard]] Table read_table(const std::filesystem::path& file);
[[nodiscard]] nlohmann::json read_json(const std::filesystem::path& file);

// A viewer that is told what to do line by line.
class ScriptedViewer {
 public:
  ScriptedViewer(const std::string& address, const Xvfb& screen, std::vector<std::string> more = {});
  // Says a command and waits for the line that answers; empty where none comes.
  [[nodiscard]] std::string ask(const std::string& command,
                                std::chrono::milliseconds patience = std::chrono::seconds{60});
  // The same; true when the answer begins with "ok".
  [[nodiscard]] bool tell(const std::string& command, std::chrono::milliseconds patience = std::chrono::seconds{60});
  [[nodiscard]] Process& process() { return process_; }

 private:
  Process process_;
};

class Stage {
 public:
  // Imports the layered block (5, 20, 5 mm) and starts a server on it.
  explicit Stage(double width_mm = 40.0, std::vector<std::string> server_arguments = {});
  // The same on a case that `make_case` leaves in the folder that it is given.
  explicit Stage(const std::function<void(const std::filesystem::path&)>& make_case,
                 std::vector<std::string> server_arguments = {});

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return temp_ / name; }
  [[nodiscard]] Process& server() { return *server_; }
  // Another server on the same case, after the first has ended; the stage's address is its own now.
  void start_server(std::vector<std::string> more);
  [[nodiscard]] Process start(const std::string& name, std::vector<std::string> arguments,
                              ProcessOptions options = {}) const;
  // A haptic client that carries out a plan and leaves NAME.csv, NAME-cuts.csv and NAME.json, of a person or of nobody
  // known.
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
