// osteon-import: makes cases from CT scans, label volumes and phantoms, and works on them without a room.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string_view>

#include "common/core/freed_memory.hpp"
#include "common/runtime/command_line.hpp"
#include "common/runtime/log.hpp"
#include "server/import/command.hpp"
#include "server/upload_validation/case_check.hpp"

int main(int argc, char** argv) {
  using namespace osteon;
  // What "unpack" starts: the process that reads a file of untrusted origin.
  if (argc == 5 && std::string_view(argv[1]) == "check-case") run_case_check(argv[2], argv[3], argv[4]);
  keep_no_large_freed_blocks();
  static constexpr const char* kProgram = "osteon-import";
  CLI::App app("Makes a case, the bone that osteon-server loads, from a CT scan, a label volume, a mesh or a phantom.",
               kProgram);
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Help for all commands");
  std::vector<import::Command> commands;
  import::add_case_commands(app, commands);
  import::add_scan_commands(app, commands);
  import::add_case_file_commands(app, commands);
  import::add_phantom_command(app, commands);
  import::add_registration_command(app, commands);
  import::add_bone_commands(app, commands);
  import::add_subvolume_command(app, commands);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;

  // Never destroyed: a signal during the exit would make a success, whose files have their names already, look like a
  // failure that left nothing.
  static const StopSignal& stop = *new StopSignal;
  const auto chosen =
      std::ranges::find_if(commands, [](const import::Command& command) { return command.app->parsed(); });
  const auto text = chosen->run(stop);
  if (!text)
    return log::exit_with(kProgram, text.error().code == ErrorCode::cancelled ? import::stopped() : text.error());
  std::fputs(text->c_str(), stdout);
  return 0;
}
