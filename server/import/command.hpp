// The common part of the commands of osteon-import: how they are found, run, shown and stopped.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "common/runtime/stop_signal.hpp"
#include "common/runtime/stoppable_progress.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/iso_surface.hpp"

namespace CLI {  // the library's
class App;
}

namespace osteon::import {

// One command: its part of the command line, and its work. The work returns the text for standard output.
struct Command {
  CLI::App* app;
  std::function<Result<std::string>(const StopSignal& stop)> run;
};

void add_case_commands(CLI::App& app, std::vector<Command>& commands);       // make and describe cases
void add_scan_commands(CLI::App& app, std::vector<Command>& commands);       // show a scan before it is a case
void add_case_file_commands(CLI::App& app, std::vector<Command>& commands);  // pack a case, and unpack it
void add_registration_command(CLI::App& app, std::vector<Command>& commands);
void add_subvolume_command(CLI::App& app, std::vector<Command>& commands);
void add_phantom_command(CLI::App& app, std::vector<Command>& commands);
void add_bone_commands(CLI::App& app, std::vector<Command>& commands);  // work on a case's bone, and list the tools

// One progress bar over all stages.
class Bar {
 public:
  explicit Bar(const StopSignal& stop, const char* what = "importing") : progress_(stop, what) {}
  [[nodiscard]] KeepGoing stage(double begin, double end) {
    return [this, begin, end](double fraction) { return progress_.go_on(begin + (end - begin) * fraction); };
  }

 private:
  StoppableProgress progress_;
};

[[nodiscard]] inline Error stopped() { return {ErrorCode::cancelled, "stopped; nothing was written"}; }

// Checked before the work, not after minutes of it. Error: exists.
[[nodiscard]] Result<void> check_free(const std::string& path);

// Saves a case unless the user has stopped the command. Errors: those of Case::save().
[[nodiscard]] Result<void> save(const Case& bone, const std::string& out, const StopSignal& stop);
[[nodiscard]] Result<void> save(const Case& bone, const CaseScan& scan, const std::string& out, const StopSignal& stop);

}  // namespace osteon::import
