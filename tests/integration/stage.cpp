#include "tests/integration/stage.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "tests/support/wait.hpp"

namespace osteon::test {

using namespace std::chrono_literals;

Table read_table(const std::filesystem::path& file) {
  std::ifstream in(file);
  Table table;
  std::string line, cell;
  std::vector<std::string> names;
  if (std::getline(in, line))
    for (std::istringstream header(line); std::getline(header, cell, ',');) names.push_back(cell);
  while (std::getline(in, line)) {
    std::istringstream entry(line);
    for (const std::string& name : names) {
      cell.clear();
      std::getline(entry, cell, ',');
      table.texts[name].push_back(cell);
      char* end = nullptr;
      const double value = std::strtod(cell.c_str(), &end);
      table.columns[name].push_back(end != cell.c_str() ? value : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return table;
}

nlohmann::json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in, nullptr, false);
}

namespace {

std::vector<std::string> viewer_arguments(const std::string& address, std::vector<std::string> more) {
  std::vector<std::string> arguments{
      "--server", address, "--size", "640x480", "--most-frames", std::to_string(kViewerFrames_hz), "--script", "-"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// The case of a block. The process makes it once, because the importer takes as long as most tests compute.
std::filesystem::path block(double width_mm) {
  static const TempDir all;
  const std::string width = std::to_string(width_mm);
  std::filesystem::path made = all / width;
  if (std::filesystem::exists(made)) return made;
  const RunResult imported = run(program("osteon-import"),
                                 {"phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width", width, "--pitch",
                                  "0.5", "--out", made.string()},
                                 120s);
  if (imported.exit_code != 0) throw std::runtime_error("osteon-import failed: " + imported.err);
  return made;
}

}  // namespace

ScriptedViewer::ScriptedViewer(const std::string& address, const Xvfb& screen, std::vector<std::string> more)
    : process_(program("osteon-viewer"), viewer_arguments(address, std::move(more)), screen.options()) {}

std::string ScriptedViewer::ask(const std::string& command, std::chrono::milliseconds patience) {
  process_.write(command + "\n");
  return process_.read_line(patience).value_or("");
}

bool ScriptedViewer::tell(const std::string& command, std::chrono::milliseconds patience) {
  return ask(command, patience).starts_with("ok");
}

Stage::Stage(double width_mm, std::vector<std::string> server_arguments) {
  std::filesystem::copy(block(width_mm), temp_ / "case", std::filesystem::copy_options::recursive);
  start_server(std::move(server_arguments));
}

Stage::Stage(const std::function<void(const std::filesystem::path&)>& make_case,
             std::vector<std::string> server_arguments) {
  make_case(temp_ / "case");
  start_server(std::move(server_arguments));
}

void Stage::start_server(std::vector<std::string> more) {
  std::vector<std::string> arguments{"--case",          temp_ / "case", "--address-file",
                                     temp_ / "address", "--summary",    temp_ / "server.json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  std::filesystem::remove(temp_ / "address");
  server_ = std::make_unique<Process>(start("osteon-server", arguments));
  const auto address = wait_for_address(temp_ / "address", 60s);
  if (!address) throw std::runtime_error("osteon-server did not come up: " + server_->err());
  address_ = *address;
}

Process Stage::start(const std::string& name, std::vector<std::string> arguments, ProcessOptions options) const {
  return {program(name), arguments, std::move(options)};
}

Process Stage::start_haptic(const std::string& name, const nlohmann::json& plan, const std::string& person) const {
  const auto plan_file = temp_ / (name + "-plan.json");
  std::ofstream(plan_file) << plan.dump(2);
  return start("osteon-haptic", {"--server", address_, "--plain", "--name", person, "--plan", plan_file,
                                 "--session-log", temp_ / (name + ".csv"), "--cut-log", temp_ / (name + "-cuts.csv"),
                                 "--summary", temp_ / (name + ".json"), "--cache", temp_ / "cache"});
}

bool Stage::is_at_work(const std::string& name) const {
  constexpr std::ptrdiff_t kTicks = 3000;
  return wait_until(
      [&] {
        std::ifstream log(temp_ / (name + ".csv"));
        return std::count(std::istreambuf_iterator<char>(log), {}, '\n') > kTicks;
      },
      60s);
}

nlohmann::json drill_at(double x_mm, double y_mm, const std::string& hand) {
  return {{"action", "drill"},
          {"tool", "drill-3.2"},
          {"spindle_rpm", 1000},
          {"hand", hand},
          {"feed_mm_per_s", 1.0},
          {"beyond_mm", 3.0},
          {"entry", {{"point_mm", {x_mm, y_mm, 0.0}}, {"axis", {0.0, 0.0, -1.0}}}}};
}

}  // namespace osteon::test
