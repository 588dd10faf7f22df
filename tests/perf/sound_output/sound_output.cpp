// osteon-sound-output: how well sound comes out of a sink without a card. deploy/with-null-sink runs it.
//   gapless   plays a drilling for minutes, and compares what was rendered with what came out, bit by bit
//   latency   applies cuts on a server, and times the first sample that they change
// Prints JSON.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/runtime/command_line.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/number_option.hpp"
#include "tests/perf/sound_output/output_trial.hpp"

int main(int argc, char** argv) {
  using namespace osteon;
  constexpr const char* kName = "osteon-sound-output";
  test::OutputTrial trial;
  CLI::App app("Measures the way of the sound from a cut to the sink's monitor.", kName);
  app.require_subcommand(1);
  CLI::App* gapless = app.add_subcommand("gapless", "Gaps, and what the callback costs");
  CLI::App* latency = app.add_subcommand("latency", "From a cut on the server to the first changed sample");
  gapless->add_option("minutes", trial.minutes)->check(number_in(0.05, 60.0))->capture_default_str();
  latency->add_option("cuts", trial.cuts)->check(CLI::Range(1, 10'000))->capture_default_str();
  for (CLI::App* command : {gapless, latency}) {
    command->add_option("--listen", trial.listen, "loudspeakers, headphones or mono")->capture_default_str();
    command->add_option("--frames", trial.output.frames, "In a buffer")->check(CLI::Range(32, 4096));
    command->add_flag("--awake", trial.awake,
                      "Keep the processors from sleeping, by threads that give way to all others");
    command->add_option("--buffers", trial.output.buffers)->check(CLI::Range(2, 64));
  }
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  log::open(kName);
  const Result<nlohmann::json> found = gapless->parsed() ? test::play_without_gaps(trial) : test::time_cuts(trial);
  if (!found) return log::exit_with(kName, found.error());
  std::printf("%s\n", found->dump(1).c_str());
  return 0;
}
