#include "haptic_client/app/plan_command.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <vector>

#include "common/runtime/command_line.hpp"
#include "common/runtime/log.hpp"
#include "haptic_client/app/plan_file.hpp"

namespace osteon::haptic {

int run_plan(int argc, const char* const* argv) {
  constexpr const char* kCommand = "osteon-haptic plan";
  std::vector<std::filesystem::path> files;
  CLI::App app("Checks plans of simulated surgeons. deploy/docs/haptics.md describes their fields.", kCommand);
  app.require_subcommand(1);
  CLI::App* check =
      app.add_subcommand("check", "Checks plans, and names step, field and remedy of the first fault of each");
  check->add_option("FILE", files, "Plans, JSON files")->required();
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  // A fault in one plan hides none in the next.
  int code = 0;
  for (const std::filesystem::path& file : files) {
    const Result<std::vector<PlanStep>> plan = read_plan(file);
    if (!plan)
      code = log::exit_with(kCommand, plan.error());
    else
      std::printf("%s: valid, %zu step%s\n", file.c_str(), plan->size(), plan->size() == 1 ? "" : "s");
  }
  return code;
}

}  // namespace osteon::haptic
