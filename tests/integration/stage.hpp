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

// Pictures a second of a ScriptedViewer. In software, 30 would take more than a processor.
constexpr int kViewerFrames_hz = 4;

// A viewer that is controlled by lines of commands.
class ScriptedViewer {
 public:
  // Runs `osteon-viewer --server ADDRESS --size 640x480 --most-frames HZ --script - MORE`.
  ScriptedViewer(const std::string& address, const Xvfb& screen, std::vector<std::string> more = {"--plain"});
  // Sends a command and waits for the answering line. Empty if none comes.
  [[nodiscard]] std::string ask(const std::string& command,
                                std::chrono::milliseconds patience = std::chrono::seconds{60});
  // Does the same. True if the answer begins with "ok".
  [[nodiscard]] bool tell(const std::string& command, std::chrono::milliseconds patience = std::chrono::seconds{60});
  [[nodiscard]] Process& process() { return process_; }

 private:
  Process process_;
};

// A folder with a case, and a server of that case.
class Stage {
 public:
  // Copies what `osteon-import phantom block --layers 5:1.9,20:0.3,5:1.9 --width WIDTH --pitch 0.5` makes to `case`,
  // then start_server().
  explicit Stage(double width_mm = 40.0, std::vector<std::string> server_arguments = {"--plain"});
  // Does the same with a case that `make_case` writes to the given folder.
  explicit Stage(const std::function<void(const std::filesystem::path&)>& make_case,
                 std::vector<std::string> server_arguments = {"--plain"});

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return temp_ / name; }
  [[nodiscard]] Process& server() { return *server_; }
  // Runs `osteon-server --case case --address-file address --summary server.json MORE` in the stage's folder, once the
  // server before has ended. The stage's address changes to the new server's.
  void start_server(std::vector<std::string> more);
  [[nodiscard]] Process start(const std::string& name, std::vector<std::string> arguments,
                              ProcessOptions options = {}) const;
  // Writes the plan to NAME-plan.json, then runs `osteon-haptic --server ADDRESS --plain --name PERSON --plan
  // NAME-plan.json --session-log NAME.csv --cut-log NAME-cuts.csv --summary NAME.json --cache cache` in the stage's
  // folder. An empty `person` is an unknown one.
  [[nodiscard]] Process start_haptic(const std::string& name, const nlohmann::json& plan,
                                     const std::string& person = {}) const;
  // Waits until the session log of start_haptic(NAME) has 3000 ticks, which are 3 s of work on a fast enough machine.
  // False: it has not after a minute.
  [[nodiscard]] bool is_at_work(const std::string& name) const;

 private:
  TempDir temp_;
  std::unique_ptr<Process> server_;
  std::string address_;
};

// A step that drills along −z through the block at (x, y).
[[nodiscard]] nlohmann::json drill_at(double x_mm, double y_mm, const std::string& hand);

}  // namespace osteon::test
